"""The researcher's page in browsers: no fault for axe-core, by keys alone, and without scripts but for watching."""

import json
import os
from contextlib import contextmanager

import pytest
from scripted_workers import hello
from study_site import PASSWORD, phase_of, served
from websockets.sync.client import connect

from tests.experiments.web.browser.test_accessibility import LOOKS, violations

pytestmark = pytest.mark.slow
BROWSERS = ["chromium", "firefox"] if "MJSIM_ALL_CONDITIONS" in os.environ else ["chromium"]
TITLE = "document.querySelector('h1')?.textContent"


@pytest.fixture
def site(tmp_path):
    with served(tmp_path, 'phases = ["consent", "task", "completion"]\n') as site:
        yield site


def log_in(page, site):
    """By keys alone."""
    page.set_default_timeout(60_000)
    page.goto(site.researcher_url)
    page.locator("#name:focus").wait_for()  # what is typed before goes nowhere
    page.keyboard.type("owner")
    page.keyboard.press("Tab")
    page.keyboard.type(PASSWORD)
    page.keyboard.press("Enter")
    page.get_by_role("heading", name="Overview").wait_for()


def consented(site):
    """Link of somebody whose next phase is the task."""
    with site.client() as client:
        link = site.begin(client)
        client.post(link, data={"phase": "consent", "agree": "yes"})
        assert phase_of(client, link) == "task"
    return link


@contextmanager
def reading(site, link):
    """Socket of somebody who reads the instructions of the task."""
    address = site.url.replace("http", "ws", 1).rstrip("/") + link
    with connect(address, origin=site.url.rstrip("/"), close_timeout=1) as socket:
        socket.send(json.dumps(hello("task")))
        while json.loads(socket.recv(timeout=60)).get("phase") != "ready":
            pass
        yield socket


@pytest.mark.parametrize("look", LOOKS)
def test_no_page_breaks_a_rule_of_axe_core(site, chromium, look, monkeypatch):
    monkeypatch.setattr("experiments.study.researcher.app.PAGE_SIZE", 1)
    link = consented(site)
    consented(site)
    page = chromium.new_context(**look).new_page()
    page.goto(site.researcher_url)
    found = violations(page)
    log_in(page, site)
    found += violations(page)
    site.ask(site.store.ledger.decide(1, "reward", 150, "USD", "p00001-reward"))
    page.get_by_label("participants wanted").fill("7")
    page.get_by_role("button", name="Change").press("Enter")
    page.get_by_role("cell", name="7", exact=True).wait_for()
    for button in ("Pause", "Continue", "Stop the study", "Reopen"):
        page.get_by_role("button", name=button, exact=True).press("Enter")
        found += violations(page)
    for name in ("Participants", "Audit log"):
        page.get_by_role("link", name=name).press("Enter")
        page.get_by_role("heading", name=name).wait_for()
        found += violations(page)
    page.goto(f"{site.researcher_url}people?find=consent&page=2")
    found += violations(page)
    with reading(site, link) as socket:
        page.goto(f"{site.researcher_url}people/1")
        found += violations(page)
        page.get_by_role("link", name="Watch").press("Enter")
        page.get_by_text("reading the instructions").wait_for()
        found += violations(page)
        socket.send('{"type": "run", "until": null}')
        page.locator("[data-phase=running]").wait_for()
        found += violations(page)
    page.get_by_role("link", name="Back to").press("Enter")
    page.get_by_role("button", name="Log out", exact=True).press("Enter")
    page.get_by_role("heading", name="Log in").wait_for()
    assert found == []


@pytest.mark.parametrize("browser", BROWSERS)
def test_numbers_change_by_themselves_and_a_session_is_watched(site, request, browser):
    page = request.getfixturevalue(f"{browser}_page")
    page.goto(site.researcher_url)
    page.wait_for("document.activeElement?.id === 'name'")
    for key in (*"owner", "Tab", *PASSWORD, "Enter"):
        page.hold(key)
    page.wait_for(f"{TITLE} === 'Overview'")
    counted = "[...document.querySelectorAll('#statuses dd')].some((count) => count.textContent === '1')"
    assert not page.evaluate(counted)
    link = consented(site)
    page.wait_for(counted)
    with reading(site, link):
        page.goto(f"{site.researcher_url}people/1/watch")
        page.wait_for("document.body.textContent.includes('reading the instructions')")
    assert page.faults == []


def test_all_works_without_scripts(site, chromium, monkeypatch):
    monkeypatch.setattr("experiments.study.researcher.app.PAGE_SIZE", 1)
    consented(site)
    consented(site)
    plain = chromium.new_context(java_script_enabled=False).new_page()
    log_in(plain, site)
    plain.get_by_role("button", name="Pause").press("Enter")
    plain.get_by_text("The study is paused").wait_for()
    plain.get_by_role("link", name="Participants").press("Enter")
    assert plain.get_by_role("link", name="p00001").is_visible()
    plain.get_by_role("link", name="Next page").press("Enter")
    plain.get_by_role("link", name="p00002").wait_for()
    plain.get_by_label("Name, status or phase").fill("p00001")
    plain.get_by_role("button", name="Search").press("Enter")
    plain.get_by_text("1 participant").wait_for()
    assert plain.get_by_role("link", name="p00001").is_visible()
