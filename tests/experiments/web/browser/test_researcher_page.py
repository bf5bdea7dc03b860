"""The researcher's page in a browser: no fault for axe-core, by keys alone, and without scripts but for watching."""

import json

import pytest
from scripted_workers import hello
from study_site import PASSWORD, phase_of, served
from websockets.sync.client import connect

from tests.experiments.web.browser.test_accessibility import DESK, PHONE, violations

pytestmark = pytest.mark.slow


@pytest.fixture
def site(tmp_path):
    with served(tmp_path, 'phases = ["consent", "task", "completion"]\n') as site:
        yield site


def log_in(page, site):
    """By keys alone."""
    page.set_default_timeout(60_000)
    page.goto(site.researcher_url)
    page.get_by_role("heading", name="Log in").wait_for()
    page.keyboard.type("owner")
    page.keyboard.press("Tab")
    page.keyboard.type(PASSWORD)
    page.keyboard.press("Enter")
    page.get_by_role("heading", name="Overview").wait_for()


@pytest.mark.parametrize("look", [DESK, PHONE])
def test_no_page_breaks_a_rule_of_axe_core(site, chromium, look):
    with site.client() as client:
        link = site.begin(client)
        client.post(link, data={"phase": "consent", "agree": "yes"})
        assert phase_of(client, link) == "task"
    page = chromium.new_context(**look).new_page()
    page.goto(site.researcher_url)
    found = violations(page)
    log_in(page, site)
    found += violations(page)
    site.ask(site.store.ledger.decide(1, "reward", 150, "USD", "p00001-reward"))
    page.get_by_label("people wanted").fill("7")
    page.get_by_role("button", name="Change").press("Enter")
    page.get_by_role("cell", name="7", exact=True).wait_for()
    for button in ("Pause", "Continue", "Stop the study", "Reopen"):
        page.get_by_role("button", name=button, exact=True).press("Enter")
        found += violations(page)
    for name in ("People", "Audit log"):
        page.get_by_role("link", name=name).press("Enter")
        page.get_by_role("heading", name=name).wait_for()
        found += violations(page)
    address = site.url.replace("http", "ws", 1).rstrip("/") + link
    with connect(address, origin=site.url.rstrip("/"), close_timeout=1) as socket:
        socket.send(json.dumps(hello("task")))
        while json.loads(socket.recv(timeout=60)).get("phase") != "ready":
            pass
        page.goto(f"{site.researcher_url}people/1")
        found += violations(page)
        page.get_by_role("link", name="Watch").press("Enter")
        page.get_by_text("reads the instructions").wait_for()
        found += violations(page)
        socket.send('{"type": "run", "until": null}')
        page.locator("[data-phase=running]").wait_for()
        found += violations(page)
    page.get_by_role("link", name="Back to").press("Enter")
    page.get_by_role("button", name="Log out", exact=True).press("Enter")
    page.get_by_role("heading", name="Log in").wait_for()
    assert found == []


def test_numbers_change_by_themselves_and_all_works_without_scripts(site, chromium):
    page = chromium.new_page()
    log_in(page, site)
    assert page.locator("#statuses dd").first.inner_text() == "0"
    with site.client() as client:
        site.begin(client)
    page.locator("#statuses dd").first.get_by_text("1").wait_for()
    plain = chromium.new_context(java_script_enabled=False).new_page()
    log_in(plain, site)
    plain.get_by_role("button", name="Pause").press("Enter")
    plain.get_by_text("The study is paused").wait_for()
    plain.get_by_role("link", name="People").press("Enter")
    assert plain.get_by_role("link", name="p00001").is_visible()
