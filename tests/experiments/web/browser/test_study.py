"""A study in a browser: no page breaks a rule of axe-core, and keys alone lead from the first page to the last."""

import sqlite3
import subprocess
import sys

import msgspec
import pytest

from benchmarks.support.play_server import PATIENCE
from experiments.house import House
from experiments.record import records
from experiments.replay.replay import replay
from experiments.trials.setup import trial_episode
from experiments.trials.trial_config import TrialConfig
from tests.experiments.web.browser.key_presser import WATCH, KeyPresser, choose
from tests.experiments.web.browser.test_accessibility import DESK, PHONE, violations

STUDY = """
[[cells]]
assistance = "optimal"
objects = 1
people = 4
house_seeds = 0
fidelity = "event"

[study]
name = "small"
title = "A small study"
institution = "a test"
contact = "nobody@example.org"
phases = ["consent", "device", "story", "comprehension", "training", "task", "survey", "debriefing", "completion"]

[study.device]
frames_per_s = 1
latency_ms = 100000
width = 300
height = 300

[study.recruitment]
completed = "DONE"
"""


@pytest.fixture
def served(tmp_path):
    """URL and folder of a study that is served."""
    (tmp_path / "study.toml").write_text(STUDY)
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
        yield url, tmp_path
        process.terminate()
        process.wait(PATIENCE)


def at_phase(folder, name):
    """Let everybody be in a phase, as if what comes before it was done."""
    with sqlite3.connect(folder / "out" / "study.db", timeout=PATIENCE) as database:
        database.execute("UPDATE person SET phase = ?", (name,))
    database.close()


@pytest.mark.parametrize("look", [DESK, PHONE])
def test_no_page_breaks_a_rule_of_axe_core(served, chromium, look):
    url, folder = served
    page = chromium.new_context(**look).new_page()
    page.set_default_timeout(1000.0 * PATIENCE)
    found = []

    def send():
        with page.expect_navigation():
            page.get_by_role("button", name="Continue").press("Enter")
        found.extend(violations(page))

    page.goto(url)
    found += violations(page)
    page.get_by_role("button", name="Begin").press("Enter")
    page.get_by_role("heading", name="Your consent").wait_for()
    found += violations(page)
    send()
    assert page.get_by_role("alert").inner_text() == "Please answer this question."
    page.get_by_role("checkbox").press("Space")
    send()
    page.get_by_text("Press the W key").wait_for()
    found += violations(page)
    page.keyboard.press("w")
    page.locator(".button:focus").wait_for()
    found += violations(page)
    send()
    assert page.get_by_role("heading", name="Your task").is_visible()
    send()
    send()  # without answers
    assert page.locator(".faults").evaluate("element => element === document.activeElement")
    at_phase(folder, "survey")
    page.reload()
    send()
    for scale in page.locator("fieldset.scale").all():
        scale.locator("input").nth(2).press("Space")
    send()
    page.get_by_role("link", name="Leave the study").press("Enter")
    page.get_by_role("heading", name="Leave the study?").wait_for()
    found += violations(page)
    page.get_by_role("link", name="Stay").press("Enter")
    page.get_by_role("heading", name="What this study is about").wait_for()
    send()
    assert page.get_by_text("DONE").is_visible()
    assert found == []


@pytest.mark.slow
def test_a_whole_visit_by_keys_from_consent_to_the_completion_code(served, chromium_page):
    url, folder = served
    page, house = chromium_page, House.load()
    page.prepare(WATCH)
    page.resize(800, 600)
    page.goto(url)
    for title, keys in (
        ("A small study", ["Enter"]),
        ("Your consent", ["Tab", " ", "Enter"]),
        ("Your computer", []),
    ):
        page.wait_for(f"document.querySelector('h1')?.textContent === '{title}'")
        for key in keys:
            page.hold(key)
    page.wait_for("document.querySelector('#state')?.textContent.includes('Press the W')")
    page.hold("w")
    page.wait_for("document.activeElement?.className === 'button'")
    page.hold("Enter")
    page.wait_for("document.querySelector('h1')?.textContent === 'Your task'")
    page.evaluate("document.querySelector('form .button').focus()")
    page.hold("Enter")
    page.wait_for("document.querySelectorAll('fieldset').length === 3")
    for number, down in enumerate((0, 1, 1)):
        page.evaluate(f"document.querySelectorAll('fieldset')[{number}].querySelector('input').focus()")
        page.hold(" ")
        for _ in range(down):
            page.hold("ArrowDown")
    page.hold("Enter")
    page.wait_for("document.querySelector('#play')?.dataset.trial === 'training'")
    address = page.evaluate("location.href")
    page.goto(f"{address}?draw=browser")
    name = sorted((folder / "out" / "visits").iterdir())[0]
    settings = msgspec.json.decode((name / "visit.json").read_bytes())["trials"]
    for trial in ("training", "task"):
        page.wait_for(f"document.querySelector('#play')?.dataset.trial === '{trial}'")
        choose(page, "Start the training" if trial == "training" else "Start")
        page.wait_for("document.querySelectorAll('#list li').length > 0")
        KeyPresser(page, house, trial_episode(TrialConfig.of(settings[trial]), house)).tidy()
    page.wait_for("document.querySelectorAll('fieldset.scale').length === 17")
    for number in range(17):
        page.evaluate(f"document.querySelectorAll('fieldset')[{number}].querySelectorAll('input')[3].focus()")
        page.hold(" ")
    page.hold("Enter")
    page.wait_for("document.querySelector('h1')?.textContent === 'What this study is about'")
    page.evaluate("document.querySelector('form .button').focus()")
    page.hold("Enter")
    page.wait_for("document.body.textContent.includes('DONE')")
    run = name / "task"
    assert msgspec.json.decode((run / records.METRICS).read_bytes())["delivered"] == 1
    assert all(verdict.verified for verdict in replay(run).verdicts)
