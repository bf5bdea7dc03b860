"""Browsers of the system: Chromium, driven by Playwright, and Firefox."""

import pytest

from benchmarks.support.chromium import CHROMIUM, chromium_browser
from tests.experiments.web.browser.pages import FIREFOX, XVFB, Chromium, firefox, virtual_screen


@pytest.fixture(scope="module")
def shared_chromium():
    """A browser without a screen."""
    if not CHROMIUM.is_file():
        pytest.skip(f"no browser at {CHROMIUM}")
    with chromium_browser() as browser:
        yield browser


@pytest.fixture
def chromium(shared_chromium):
    """A browser without a screen, and without a page or a cookie."""
    yield shared_chromium
    for context in shared_chromium.contexts:
        context.close()


@pytest.fixture
def chromium_page(chromium):
    """A page that can draw."""
    return Chromium(chromium.new_page())


@pytest.fixture
def firefox_page(tmp_path):
    """A page that can draw."""
    if FIREFOX is None or XVFB is None:
        pytest.skip("no Firefox here, or no Xvfb, without which it has no WebGL")
    with virtual_screen() as screen, firefox(tmp_path / "profile", screen) as page:
        yield page
