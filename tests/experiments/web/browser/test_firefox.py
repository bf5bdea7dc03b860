"""A training in stock Firefox, driven by the protocol that it speaks itself (WebDriver BiDi)."""

import json
import re
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path

import pytest
from websockets.sync.client import connect

from benchmarks.play import FAST
from benchmarks.support.play_server import PATIENCE, PlayProcess

FIREFOX = next(
    (path for path in map(Path, ("/usr/bin/firefox", "/usr/bin/firefox-esr")) if path.is_file()), None
)
KEYS = {"Enter": "\ue007", "ArrowLeft": "\ue012"}  # of WebDriver
TITLE = "document.getElementById('panel-title')?.textContent"
DRAWN = """(() => {
    const small = document.createElement("canvas").getContext("2d");
    small.drawImage(document.getElementById("screen"), 0, 0, 8, 8);
    return small.getImageData(0, 0, 8, 8).data.some((value, i) => i % 4 < 3 && value > 40);
})()"""


class Firefox:
    """One tab of a browser that listens at an address."""

    def __init__(self, socket):
        self._socket, self._count = socket, 0
        self._ask("session.new", capabilities={})
        # The first one never has the focus.
        self._tab = self._ask("browsingContext.create", type="tab")["context"]

    def goto(self, url):
        self._ask("browsingContext.navigate", context=self._tab, url=url, wait="complete")

    def evaluate(self, expression):
        target = {"context": self._tab}
        answer = self._ask("script.evaluate", expression=expression, target=target, awaitPromise=True)
        return answer["result"].get("value")

    def wait_for(self, expression):
        until = time.monotonic() + PATIENCE
        while not self.evaluate(f"Boolean({expression})"):
            assert time.monotonic() < until, f"{expression}: {self.evaluate('document.body.innerText')}"
            time.sleep(0.1)

    def hold(self, key, seconds=0.05):
        value = KEYS.get(key, key)
        actions = [
            {"type": "keyDown", "value": value},
            {"type": "pause", "duration": round(1000 * seconds)},
            {"type": "keyUp", "value": value},
        ]
        keys = [{"type": "key", "id": "keys", "actions": actions}]
        self._ask("input.performActions", context=self._tab, actions=keys)

    def _ask(self, method, **params):
        self._count += 1
        self._socket.send(json.dumps({"id": self._count, "method": method, "params": params}))
        while (answer := json.loads(self._socket.recv(timeout=PATIENCE))).get("id") != self._count:
            pass
        assert answer["type"] != "error", f"{method}: {answer['message']}"
        return answer["result"]


@contextmanager
def firefox(profile):
    """A Firefox without a screen; `profile` is an empty folder."""
    log = profile / "log.txt"
    words = ["--headless", "--no-remote", "--remote-debugging-port", "0", "--profile", str(profile)]
    with (
        log.open("wb") as output,
        subprocess.Popen([str(FIREFOX), *words], stdout=output, stderr=output) as process,
    ):
        until = time.monotonic() + PATIENCE
        while not (address := re.search(r"BiDi listening on (ws://\S+)", log.read_text())):
            assert process.poll() is None and time.monotonic() < until, log.read_text()
            time.sleep(0.1)
        with connect(f"{address[1]}/session", max_size=None) as socket:
            yield Firefox(socket)
            process.terminate()


@pytest.mark.skipif(FIREFOX is None, reason="no Firefox here")
def test_firefox_shows_the_task_and_turns(tmp_path):
    (tmp_path / "profile").mkdir()
    with (
        PlayProcess(tmp_path / "visits", "--objects", "1", *FAST) as server,
        firefox(tmp_path / "profile") as browser,
    ):
        browser.goto(server.url)
        browser.hold("Enter")
        browser.wait_for(f"{TITLE} === 'Training' && document.activeElement.textContent.startsWith('Start')")
        browser.hold("Enter")
        browser.wait_for("!document.getElementById('panel').open")
        browser.wait_for("document.getElementById('list').children.length > 0")
        browser.wait_for(DRAWN)
        picture = "document.getElementById('screen').toDataURL()"
        before = browser.evaluate(picture)
        browser.hold("ArrowLeft", 0.6)
        browser.wait_for(f"{picture} !== {json.dumps(before)}")
