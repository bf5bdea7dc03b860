"""Measure the time from opening the link of a visit until the Start button can be pressed."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, BrowserContext, Page

from benchmarks.support.chromium import chromium_browser
from benchmarks.support.play_server import PATIENCE, TASK_ALONE, PlayProcess, ProgressReport

SLOW = {"offline": False, "latency": 80, "downloadThroughput": 10e6 / 8, "uploadThroughput": 10e6 / 8}
# Time in ms until the Start button appears, which is when the house has been loaded and compiled
PLAYABLE = """() => {
  const start = document.querySelector("#panel[open] button.button:enabled");
  return document.querySelector("#play[data-phase=ready]") && start?.checkVisibility() && performance.now();
}"""
WIDTH, HEIGHT = 1280, 720  # size of the browser window in pixels


@dataclass(frozen=True)
class Opened:
    """Measurements of opening a visit in the browser.

    Attributes:
        seconds: Time from opening the link until Start can be pressed, s.
        megabytes: Received data in MB, including data that is loaded later.
    """

    seconds: float
    megabytes: float


def measure_first_frame(
    folder: Path, tries: int, report: ProgressReport, *words: str
) -> dict[str, dict[str, Any]]:
    """Measure how long it takes to open a visit in several cases, usually as the median of `tries` runs."""
    cases: dict[str, list[Opened]] = {}
    slots = "--sessions", str(3 * tries + 1)  # the server reserves a slot for a while after a page is closed
    with PlayProcess(folder, *TASK_ALONE, *slots, *words) as server, chromium_browser() as browser:
        report("the first visit to a server that has just started")
        cases["server just started"] = [_open(_context(browser), server)]
        for number in range(tries):
            report(f"round {number + 1} of {tries}")
            context = _context(browser)
            cases.setdefault("first visit", []).append(_open(context, server))
            cases.setdefault("second visit", []).append(_open(context, server))
            slow = _open(_context(browser), server, slow=True)
            cases.setdefault("first visit, 10 Mbit/s and 80 ms", []).append(slow)
            for used in browser.contexts:
                used.close()
    return {name: _median(opened) for name, opened in cases.items()}


def _context(browser: Browser) -> BrowserContext:
    """Return a browser context with an empty cache."""
    context = browser.new_context(viewport={"width": WIDTH, "height": HEIGHT})
    context.set_default_timeout(1000.0 * PATIENCE)
    return context


def _open(context: BrowserContext, server: PlayProcess, *, slow: bool = False) -> Opened:
    page = context.new_page()
    came = _count(page, slow)
    page.goto(f"{server.begin()}?draw=browser", wait_until="commit")
    seconds = page.wait_for_function(PLAYABLE).json_value() / 1000.0
    page.wait_for_load_state("networkidle")
    page.close()
    return Opened(seconds, sum(came) / 1e6)


def _count(page: Page, slow: bool) -> list[float]:
    """Count received bytes: HTTP responses as transferred, and socket messages before compression."""
    came: list[float] = []
    session = page.context.new_cdp_session(page)
    session.send("Network.enable")
    if slow:
        session.send("Network.emulateNetworkConditions", SLOW)
    session.on("Network.loadingFinished", lambda event: came.append(event["encodedDataLength"]))
    session.on(
        "Network.webSocketFrameReceived", lambda event: came.append(len(event["response"]["payloadData"]))
    )
    return came


def _median(opened: list[Opened]) -> dict[str, Any]:
    ordered = sorted(opened, key=lambda one: one.seconds)
    return {
        "seconds": ordered[len(ordered) // 2].seconds,
        "slowest": ordered[-1].seconds,
        "megabytes": max(one.megabytes for one in opened),
        "tries": len(opened),
    }
