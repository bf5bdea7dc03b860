"""The system's Chromium, driven by Playwright, headless and with software WebGL."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright

CHROMIUM = Path("/usr/bin/chromium")
# Mesa's software renderer is about four times as fast as the browser's.
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
