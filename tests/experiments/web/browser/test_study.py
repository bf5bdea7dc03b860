"""A study in a browser: no page breaks a rule of axe-core, and who shares a browser finds nothing of others."""

import sqlite3
import subprocess
import sys

import pytest

from benchmarks.support.play_server import PATIENCE
from tests.experiments.web.browser.study_visit import STUDY
from tests.experiments.web.browser.test_accessibility import DESK, PHONE, violations

pytestmark = pytest.mark.slow

CODE = """
[study.recruitment]
completed = "DONE"
"""
LAB = """
[study.recruitment]
platform = "lab"
"""
QUESTION = """
[study.recruitment]
platform = "external-question"
sites = ["https://worker.example.org"]
"""
TASK = "hitId=3HIT&turkSubmitTo=https%3A%2F%2Fworker.example.org"


@pytest.fixture
def served(request, tmp_path):
    """URL and folder of a study that is served, with a table of recruitment."""
    (tmp_path / "study.toml").write_text(STUDY + getattr(request, "param", CODE))
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


def at_phase(folder, name, status="arrived"):
    """Let everybody be in a phase, as if what comes before it was done."""
    with sqlite3.connect(folder / "out" / "study.db", timeout=PATIENCE) as database:
        database.execute("UPDATE person SET phase = ?, status = ?", (name, status))
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
    page.get_by_role("button", name="Start").press("Enter")
    page.get_by_role("heading", name="Your consent").wait_for()
    found += violations(page)
    send()
    assert page.get_by_role("alert").inner_text() == "Please answer this question."
    page.get_by_role("checkbox").press("Space")
    send()
    page.get_by_text("Press the W key").wait_for()
    assert "scene.json" in page.evaluate(
        "performance.getEntriesByType('resource').map((one) => one.name).join()"
    )
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
    page.get_by_role("heading", name="About this study").wait_for()
    send()
    assert page.get_by_text("DONE").is_visible()
    assert found == []


@pytest.mark.parametrize("served", [QUESTION], indirect=True)
def test_pages_of_a_task_in_a_frame_break_no_rule_of_axe_core(served, chromium):
    url, folder = served
    found = []
    ends = (("timed_out", "Your time is up"), ("withdrawn", "You have left"), ("finished", "Thank you"))
    for worker, look in (("A1WORKER", DESK), ("A2WORKER", PHONE)):
        page = chromium.new_context(**look).new_page()
        page.set_default_timeout(1000.0 * PATIENCE)
        page.goto(f"{url}?assignmentId=ASSIGNMENT_ID_NOT_AVAILABLE&hitId=3HIT")
        assert page.get_by_text("This is a preview").is_visible()
        found += violations(page)
        page.goto(f"{url}?assignmentId=3ASSIGNMENT&workerId={worker}&{TASK}")
        page.get_by_role("button", name="Start").press("Enter")
        page.get_by_role("heading", name="Your consent").wait_for()
        for status, said in ends:
            at_phase(folder, "completion", status)
            page.reload()
            assert said in page.get_by_role("heading").inner_text()
            assert page.get_by_text("return the task").is_visible() is (status != "finished")
            found += violations(page)
        form = page.locator("form").get_attribute("action")
        assert form == "https://worker.example.org/mturk/externalSubmit"
    assert found == []


@pytest.mark.parametrize("served", [LAB], indirect=True)
def test_in_a_lab_the_next_person_finds_nothing_of_the_last(served, chromium):
    url, folder = served
    page = chromium.new_context(**DESK).new_page()
    page.set_default_timeout(1000.0 * PATIENCE)
    kept = "JSON.stringify([{...localStorage}, {...sessionStorage}, document.cookie])"
    page.goto(url)
    page.get_by_role("button", name="Start").press("Enter")
    page.get_by_role("heading", name="Your consent").wait_for()
    link = page.url
    page.evaluate(
        f"localStorage.setItem('mjsim-visit', '\"{link}\"'); localStorage.setItem('mjsim-settings', '{{}}')"
    )
    at_phase(folder, "completion", "finished")
    page.reload()
    page.get_by_role("link", name="Start with the next participant").wait_for()
    assert violations(page) == []
    page.get_by_role("link", name="Start with the next participant").press("Enter")
    page.get_by_role("heading", name="A small study").wait_for()
    for leave in (lambda: None, page.reload):
        leave()
        assert page.get_by_role("link").count() == 0 and page.evaluate(kept) == '[{},{},""]'
    page.go_back()
    page.get_by_role("link", name="Start with the next participant").wait_for()
    assert page.locator("form").count() == 0 and page.evaluate(kept) == '[{},{},""]'
    page.get_by_role("link", name="Start with the next participant").press("Enter")
    page.get_by_role("button", name="Start").press("Enter")
    page.get_by_role("heading", name="Your consent").wait_for()
    assert page.url != link
