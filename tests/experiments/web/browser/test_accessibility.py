"""No page of a visit breaks a rule that axe-core checks, and the keyboard alone leads through all of them."""

import asyncio
import re
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue

import numpy as np
import pytest
from scripted_workers import ScriptedPool

from benchmarks.play import FAST
from benchmarks.support.play_server import PATIENCE, PlayProcess
from experiments.session.video import VideoWriter
from experiments.study.file import read_people_study
from experiments.study.recruitment import recruiter
from experiments.study.rehearsal.dry_run import dry_run
from experiments.study.rehearsal.pictures import HELP
from tests.experiments.study.rehearsal.test_readiness import STUDY, quick  # noqa: F401 - a fixture

pytestmark = pytest.mark.slow

PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
DESK = {"viewport": {"width": 1280, "height": 720}}
ZOOM = {
    "viewport": {"width": 640, "height": 360},
    "device_scale_factor": 2,
}  # the window of DESK at 200 % zoom
LOOKS = (DESK, PHONE, ZOOM)
PROLIFIC = """
[study.recruitment]
platform = "prolific"
completed = "C1"
screened_out = "C2"
no_consent = "C3"
study_id = "5f000000"
"""
PHOTOGRAPHED = {
    "welcome", "consent-refused", "device-refused", "flythrough", "comprehension-refused", "queue", "training",
    "task", HELP, "survey-refused", "debriefing", "finished", "consent-no_consent", "withdrawal", "withdrawn",
    "returning", "timed_out", "paused", "full",
}  # fmt: skip
OVERFLOW = "document.documentElement.scrollWidth - document.documentElement.clientWidth"


def violations(page):
    """What axe-core finds on a page, in words, and by how much the page is too wide for its window."""
    from axe_playwright_python.sync_playwright import Axe

    found = Axe().run(page).response["violations"]
    told = [f"{page.title()}: {v['id']} ({v['help']}): {[n['html'] for n in v['nodes']]}" for v in found]
    wide = page.evaluate(OVERFLOW)
    return [*told, f"{page.title()}: {wide} px too wide"] if wide else told


def visit(browser, server, look):
    """Go through a visit by keys; what axe-core finds on its pages and dialogs."""
    page = browser.new_context(**look).new_page()
    page.set_default_timeout(1000.0 * PATIENCE)
    found = []

    def check():
        found.extend(violations(page))

    page.goto(server.url)
    check()
    begin(page, check)
    check()
    page.get_by_role("button", name="Continue").press("Enter")
    page.get_by_role("heading", name="Training").wait_for()
    check()
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")  # skip the training
    page.get_by_role("heading", name="Your task").wait_for()
    page.locator("button:focus", has_text="Start").wait_for()
    check()
    page.keyboard.press("Enter")
    page.locator("#list li").first.wait_for(state="attached")
    check()
    found.extend(elsewhere(browser, server, page, look))
    page.keyboard.press("h")
    page.get_by_role("heading", name="Keys").wait_for()
    check()
    page.keyboard.press("Escape")
    page.locator("#help").wait_for(state="hidden")
    page.locator("#play[data-phase=running]").wait_for()
    page.keyboard.press("p")
    page.get_by_role("heading", name="Paused").wait_for()
    check()
    page.keyboard.press("p")
    page.locator("#panel").wait_for(state="hidden")
    page.locator("#end-button").press("Enter")
    page.get_by_role("heading", name="End now?").wait_for()
    check()
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    page.get_by_role("heading", name="Your result").wait_for()
    check()
    page.goto(f"{server.url}nothing-here")
    check()
    page.context.close()
    return found


def press(page, label):
    """Press Enter on the button that has the focus, once it is the button with this label."""
    page.locator("button:focus", has_text=re.compile(f"^{label}$")).wait_for()
    page.keyboard.press("Enter")


def begin(page, check=lambda: None):
    """Leave the first pages by Enter on their buttons, which have the focus as soon as the page was drawn."""
    page.locator("button:focus", has_text="Start").wait_for()
    page.keyboard.press("Enter")
    page.get_by_role("heading", name="Your task").wait_for()
    page.locator("button:focus", has_text="Continue").wait_for()
    check()
    page.keyboard.press("Enter")
    page.get_by_role("heading", name="The apartment", exact=True).wait_for()


def elsewhere(browser, server, page, look):
    """What axe-core finds where all places are taken, and where a second page takes a session over, by keys."""
    found = []
    with browser.new_context(**look) as other:
        waiting = other.new_page()
        waiting.goto(server.url)
        begin(waiting)
        waiting.get_by_role("button", name="Continue").press("Enter")
        waiting.get_by_role("heading", name="Please wait a moment").wait_for()
        found += violations(waiting)
        assert "You are number 1 in the queue" in waiting.locator("#queue").inner_text()
    second = page.context.new_page()
    second.goto(page.url)
    second.get_by_role("heading", name="This session is open on another page").wait_for()
    found += violations(second)
    press(second, "Continue here")
    page.get_by_role("heading", name="This session continues on another page").wait_for()
    found += violations(page)
    second.get_by_role("heading", name="Paused").wait_for()
    press(page, "Continue here")  # this one is loaded again, and asks in its turn
    page.get_by_role("heading", name="This session is open on another page").wait_for()
    second.close()
    press(page, "Continue here")
    page.get_by_role("heading", name="Paused").wait_for()
    press(page, "Continue")
    page.locator("#panel").wait_for(state="hidden")
    return found


DARK_PHONE = {**PHONE, "color_scheme": "dark", "reduced_motion": "reduce"}


@pytest.mark.parametrize("look", [DESK, pytest.param(DARK_PHONE, marks=pytest.mark.long)])
def test_every_page_passes_axe_and_is_left_by_keys(tmp_path, chromium, look):
    film = tmp_path / "flythrough.mp4"
    with VideoWriter(film, width=64, height=48) as writer:
        for _ in range(10):
            writer.write(np.zeros((48, 64, 3), np.uint8))
    words = ("--objects", "6", "--assistance", "guided", "--film", str(film), *FAST)
    with PlayProcess(tmp_path / "visits", *words) as server:
        assert visit(chromium, server, look) == []


@pytest.mark.long
@pytest.mark.usefixtures("quick")
def test_no_page_that_a_check_photographs_breaks_a_rule_of_axe_core(tmp_path, chromium):
    """Pages of a study in every window size, with those of refused forms, of the queue, and of all ways to end."""
    (tmp_path / "study.toml").write_text(STUDY + PROLIFIC)
    study = read_people_study(tmp_path / "study.toml")
    pages, photographed, found, shown = SimpleQueue(), SimpleQueue(), [], set()

    async def photograph(*page):
        pages.put(page)
        await asyncio.to_thread(photographed.get)

    def walk():
        try:
            platform = recruiter(study.settings.recruitment)
            return asyncio.run(dry_run(study, platform, tmp_path, ScriptedPool(), photograph))
        finally:
            pages.put(None)

    windows = [chromium.new_context(**look).new_page() for look in LOOKS]
    with ThreadPoolExecutor() as thread:
        walked = thread.submit(walk)
        for name, url, content in iter(pages.get, None):
            shown.add(name)
            for window in windows:
                window.goto(url)
                if content:
                    window.set_content(content)
                if name in ("training", "task", HELP):
                    window.locator("#panel-actions button").first.wait_for()
                if name == HELP:
                    window.locator("#help-button").press("Enter")
                found += [f"{name} at {window.viewport_size}: {fault}" for fault in violations(window)]
                window.goto("about:blank")
            photographed.put(None)
    assert walked.result().words and shown >= PHOTOGRAPHED and found == []
