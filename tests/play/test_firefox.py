"""A training in stock Firefox: its page shows frames, its keys walk."""

import math
import time

import cv2
import numpy as np
import pytest

from benchmarks import play
from benchmarks.support.firefox import FIREFOX, Firefox
from benchmarks.support.play_keys import Watcher
from benchmarks.support.play_server import PATIENCE, PlayProcess

TITLE = "document.getElementById('panel-title')?.textContent"
DRAWN = """(() => {
    const small = document.createElement("canvas").getContext("2d");
    small.drawImage(document.getElementById("screen"), 0, 0, 8, 8);
    return small.getImageData(0, 0, 8, 8).data.some((value, i) => i % 4 < 3 && value > 40);
})()"""
OPEN = "document.getElementById('panel').open"


@pytest.mark.skipif(FIREFOX is None, reason="no Firefox here")
def test_firefox_shows_the_task_and_walks(tmp_path):
    (tmp_path / "profile").mkdir()
    with (
        PlayProcess(tmp_path / "visits", "--objects", "1", *play.FAST) as server,
        Firefox(tmp_path / "profile") as browser,
    ):
        browser.goto(server.url)
        browser.hold("Enter")
        browser.wait_for(f"{TITLE} === 'Training' && document.activeElement.textContent.startsWith('Start')")
        browser.hold("Enter")
        browser.wait_for(f"!{OPEN}")
        watcher = Watcher(server.journal(browser.evaluate("location.href"), "training"))
        start = later(watcher, 0.0)
        for key in ("w", "ArrowLeft", "s", "ArrowRight"):
            browser.hold(key, 0.6)
            later(watcher, watcher.number("time") + 0.2)
            if math.dist(start, watcher.array("position")) > 0.2:
                break
        else:
            pytest.fail("no key walks")
        browser.wait_for("document.getElementById('list').children.length > 0")
        browser.wait_for(DRAWN)
        browser.screenshot(tmp_path / "firefox.png")
    picture = cv2.imread(str(tmp_path / "firefox.png"))
    assert picture.std() > 25.0 and len(np.unique(picture.reshape(-1, 3), axis=0)) > 500, (
        "a view of the house"
    )


def later(watcher, seconds):
    """Position when so much time has been simulated."""
    until = time.monotonic() + PATIENCE
    while not watcher.row or watcher.number("time") <= seconds:
        assert time.monotonic() < until, f"the session does not get to {seconds} s"
        time.sleep(0.05)
        watcher.read()
    return watcher.array("position").copy()
