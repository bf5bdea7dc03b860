"""Pages of people who wait, come back elsewhere, or find no place: they go on by themselves, and axe finds nothing."""

import pytest
from study_site import served

from tests.experiments.visit.server.test_admission import CODES, PHASES, agree, ids, leave
from tests.experiments.web.browser.test_accessibility import violations

pytestmark = pytest.mark.slow

RECRUITMENT = f'[study.recruitment]\nplatform = "prolific"\n{CODES}'


def test_who_waits_goes_on_also_without_scripts_and_who_began_here_continues(tmp_path, chromium, monkeypatch):
    monkeypatch.setattr("experiments.visit.server.trials.REFRESH", (1.0, 1.0))
    with served(tmp_path, PHASES + RECRUITMENT, workers=1) as site, site.client() as client:
        first, second, third, last = (site.begin(client, **ids(number)) for number in range(4))
        for link in (first, second, third):
            agree(client, link)
        assert "data-trial" in client.get(first).text
        base = site.url.rstrip("/")
        page, plain = (chromium.new_context(java_script_enabled=on).new_page() for on in (True, False))
        page.goto(base + second)
        assert violations(page) == []
        plain.goto(base + third)
        plain.get_by_text("number 2 in the queue").wait_for()
        leave(client, first)
        page.locator("[data-trial]").wait_for()
        leave(client, second)
        plain.locator("[data-trial]").wait_for(state="attached")
        other = {**ids(3), "SESSION_ID": "session999999"}
        query = "&".join(f"{name}={value}" for name, value in other.items())
        stranger = chromium.new_context().new_page()
        stranger.goto(f"{base}/?{query}")
        assert violations(stranger) == [] and not stranger.locator("#continue").is_visible()
        page.goto(base + last)
        page.goto(f"{base}/?{query}")
        page.locator("#continue .button").click()
        page.get_by_role("heading", name="Your consent").wait_for()
        site.ask(site.store.set_quota(0, 1, "test"))
        agree(client, last)
        page.reload()
        page.get_by_role("heading", name="All places are taken").wait_for()
        assert violations(page) == []
