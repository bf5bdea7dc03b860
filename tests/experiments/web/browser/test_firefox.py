"""A training in stock Firefox without WebGL: it shows frames of the server."""

import json

import pytest

from benchmarks.play import FAST
from benchmarks.support.play_server import PlayProcess
from tests.experiments.web.browser.pages import FIREFOX, firefox, pass_story

pytestmark = pytest.mark.slow

TITLE = "document.getElementById('panel-title')?.textContent"
DRAWN = """(() => {
    const small = document.createElement("canvas").getContext("2d");
    small.drawImage(document.getElementById("screen"), 0, 0, 8, 8);
    return small.getImageData(0, 0, 8, 8).data.some((value, i) => i % 4 < 3 && value > 40);
})()"""


@pytest.mark.skipif(FIREFOX is None, reason="no Firefox here")
def test_firefox_shows_the_task_and_turns(tmp_path):
    with (
        PlayProcess(tmp_path / "visits", "--objects", "1", *FAST) as server,
        firefox(tmp_path / "profile") as browser,
    ):
        browser.goto(server.url)
        pass_story(browser)
        browser.wait_for(f"{TITLE} === 'Training' && document.activeElement.textContent.startsWith('Start')")
        browser.hold("Enter")
        browser.wait_for("!document.getElementById('panel').open")
        browser.wait_for("document.getElementById('list').children.length > 0")
        browser.wait_for(DRAWN)
        picture = "document.getElementById('screen').toDataURL()"
        before = browser.evaluate(picture)
        browser.hold("ArrowLeft", 0.6)
        browser.wait_for(f"{picture} !== {json.dumps(before)}")
