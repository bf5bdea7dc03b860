"""Browsers of the system: Chromium, driven by Playwright, and Firefox."""

import os
from pathlib import Path

import pytest

from tests.experiments.web.browser.pages import FIREFOX, XVFB, Chromium, firefox, virtual_screen

CHROMIUM = Path("/usr/bin/chromium")
# Mesa's software, some four times as fast as the browser's own.
WEBGL = ["--use-angle=gles-egl", "--ignore-gpu-blocklist", "--enable-unsafe-swiftshader"]
FLAGS = ["--no-sandbox", "--disable-background-networking", *WEBGL]


@pytest.fixture
def chromium():
    """A browser without a screen."""
    if not CHROMIUM.is_file():
        pytest.skip(f"no browser at {CHROMIUM}")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        software = {**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1"}
        browser = driver.chromium.launch(executable_path=str(CHROMIUM), args=FLAGS, env=software)
        yield browser
        browser.close()


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
