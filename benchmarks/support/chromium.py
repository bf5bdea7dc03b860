"""Start the system's Chromium with Playwright, in headless mode and with software WebGL."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright

CHROMIUM = Path("/usr/bin/chromium")
# WebGL is about four times as fast with Mesa's software renderer as with the browser's own renderer.
WEBGL = ["--use-angle=gles-egl", "--ignore-gpu-blocklist", "--enable-unsafe-swiftshader"]
FLAGS = ["--no-sandbox", "--disable-background-networking", *WEBGL]


@contextmanager
def chromium_browser() -> Iterator[Browser]:
    with sync_playwright() as driver:
        software: dict[str, str | float | bool] = {**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1"}
        browser = driver.chromium.launch(executable_path=str(CHROMIUM), args=FLAGS, env=software)
        try:
            yield browser
        finally:
            browser.close()
