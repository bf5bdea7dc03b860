"""The pages of `mjsim house gallery` in Chromium, as files without a server."""

import pytest

from experiments.cli.main import main
from tests.experiments.web.browser.test_accessibility import DESK, PHONE, violations
from tests.experiments.web.browser.test_view import HARMLESS, LOADED, VARIED

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("gallery")]


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    out = tmp_path_factory.mktemp("gallery") / "homes of today"
    homes = ("generated:7?rooms=1", "generated:7?rooms=2")
    assert main(["house", "gallery", *homes, "--workers", "1", "--out", str(out)]) == 0
    return (out / "index.html").as_uri()


@pytest.mark.parametrize("look", [DESK, {**PHONE, "color_scheme": "dark"}], ids=["desk", "phone"])
def test_homes_are_found_and_looked_at_by_keys(chromium, address, look):
    faults = []
    page = chromium.new_context(**look).new_page()
    page.set_default_timeout(60_000.0)
    page.on("console", lambda line: faults.append(line.text) if line.type == "error" else None)
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("request", lambda request: faults.append(request.url) if request.url.startswith("http") else None)
    page.goto(address)
    assert page.locator("#count").inner_text() == "2 of 2 homes"
    found = violations(page)
    page.locator("[name=order]").select_option("largest first")
    assert "2 rooms" in page.locator("#homes li").first.inner_text()
    page.locator("[name=rooms]").select_option("1")
    assert page.locator("#count").inner_text() == "1 of 2 homes"
    page.wait_for_function("[...document.images].every((image) => image.complete && image.naturalWidth > 0)")
    page.locator("#homes a").press("Enter")
    page.wait_for_function(LOADED)
    found += violations(page)
    for camera in ("Person", "Above", "Free"):
        page.get_by_role("button", name=camera).press("Enter")
        page.wait_for_function(f"({VARIED})().then((share) => share > 0.3)")
    page.locator("#screen").press("ArrowLeft")
    page.locator("#screen").press("Space")
    page.wait_for_function("Number(document.getElementById('time').value) > 0")
    page.get_by_role("link", name="Homes").press("Enter")
    page.locator("#homes li").first.wait_for()
    assert found == []
    assert [fault for fault in faults if not any(words in fault for words in HARMLESS)] == []
    page.context.close()
