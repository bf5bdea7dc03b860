"""The page of a trial in another language: no English word is left, and all of it fits its place."""

import subprocess
import sys

import pytest

from benchmarks.support.play_server import PATIENCE
from experiments.house import read_words
from experiments.web.client_files import trial_texts
from tests.experiments.web.browser.study_visit import STUDY
from tests.experiments.web.browser.test_layout import check_shapes

pytestmark = pytest.mark.slow

PHASES = 'phases = ["training", "task", "completion"]'
# All texts of the page, also of attributes that screen readers read.
READ = """() => [...document.querySelectorAll("body *")].flatMap(e => [
  ...[...e.childNodes].filter(n => n.nodeType === 3).map(n => n.textContent.trim()),
  e.getAttribute("aria-label") ?? ""]).filter(text => /[a-z]{3}/i.test(text))"""
ROOMS = {"Flur", "Küche", "Wohnzimmer", "Schlafzimmer", "2. Schlafzimmer", "Bad", "Arbeitszimmer"}


@pytest.fixture
def german(tmp_path):
    """URL of a served study in German that begins with the training."""
    lines = [PHASES if line.startswith("phases") else line for line in STUDY.splitlines()]
    text = "\n".join(lines).replace('name = "small"', 'name = "small"\nlanguage = "de"')
    (tmp_path / "study.toml").write_text(text)
    words = ["study", "serve", "study.toml", "--out", "out", "--port", "0", "--no-open"]
    with (tmp_path / "log.txt").open("w") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "mjsim", *words],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
        )
        url = process.stdout.readline().strip()
        assert url, (tmp_path / "log.txt").read_text()
        yield url
        process.terminate()
        process.wait(PATIENCE)


def test_a_trial_in_german_has_no_english_word_and_fits_all_windows(german, chromium):
    page = chromium.new_page()
    page.set_default_timeout(1000.0 * PATIENCE)
    page.goto(german)
    page.get_by_role("button", name="Starten").press("Enter")
    page.get_by_role("heading", name="Übung").wait_for()
    assert page.evaluate("document.documentElement.lang") == "de"
    page.get_by_role("button", name="Übung starten").press("Enter")
    page.locator("#list li").first.wait_for(state="attached")
    page.locator("#room:not(:empty)").wait_for()
    assert page.locator("#room").inner_text() in ROOMS
    assert "Bringen Sie jeden Gegenstand in seinen Behälter." in page.locator("#message").inner_text()
    assert page.locator("#bins li").first.inner_text().replace("\n", " ").startswith("Geschirrkorb")
    page.get_by_role("button", name="Hilfe").click()
    page.get_by_role("heading", name="Tasten und Einstellungen").wait_for()
    english, germans = (trial_texts(read_words(language)) for language in ("en", "de"))
    foreign = {text for name, text in english.items() if text != germans[name] and "{" not in text}
    read = set(page.evaluate(READ)) - {"start"}  # the name of a gamepad's button
    assert len(read) > 60
    assert not foreign & read
    page.keyboard.press("Escape")
    check_shapes(page)
