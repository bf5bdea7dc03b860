"""Pages that tests drive: Chromium by Playwright, stock Firefox by the protocol that it speaks (WebDriver BiDi)."""

import json
import os
import re
import shutil
import signal
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Error
from websockets.sync.client import connect

from benchmarks.support.play_server import PATIENCE

FIREFOX = next(
    (path for path in map(Path, ("/usr/bin/firefox", "/usr/bin/firefox-esr")) if path.is_file()), None
)
XVFB = shutil.which("Xvfb")  # without a display, even one like this, Firefox has no WebGL
KEYS = {"Enter": "\ue007", "Tab": "\ue004"}  # of WebDriver
KEYS |= {"ArrowLeft": "\ue012", "ArrowRight": "\ue014", "ArrowDown": "\ue015"}
TRIES = 5
EVENTS = ["log.entryAdded", "network.beforeRequestSent"]


# Where an element is that is scrolled into view; null where it is not there yet.
MIDDLE = """(() => {{
    const element = document.querySelector({selector});
    element?.scrollIntoView({{ block: "center", behavior: "instant" }});
    const box = element?.getBoundingClientRect();
    return box && JSON.stringify([box.x + box.width / 2, box.y + box.height / 2]);
}})()"""


class Page:
    """A page of any browser; after `enter_frame`, scripts run and clicks go to the page in its only frame.

    Attributes:
        faults: Errors and warnings of its console.
        asked: Addresses that it asked for.
    """

    def __init__(self):
        self.faults, self.asked = [], []

    def evaluate(self, expression):
        """Its value; a page that is just being left is asked again."""
        for _ in range(TRIES):
            try:
                return self._evaluate(expression)
            except (AssertionError, Error):
                time.sleep(0.2)
        return self._evaluate(expression)

    def wait_for(self, expression):
        until = time.monotonic() + PATIENCE
        while not self.evaluate(f"Boolean({expression})"):
            assert time.monotonic() < until, f"{expression}: {self.evaluate('document.body.innerText')}"
            time.sleep(0.1)


class Chromium(Page):
    """A page of Playwright."""

    def __init__(self, page):
        super().__init__()
        self._page = page
        page.set_default_timeout(1000.0 * PATIENCE)
        page.on("console", lambda line: line.type in ("error", "warning") and self.faults.append(line.text))
        page.on("pageerror", lambda error: self.faults.append(str(error)))
        page.on("request", lambda request: self.asked.append(request.url))
        self.goto, self.reload, self.prepare = page.goto, page.reload, page.add_init_script
        self.down, self.up = page.keyboard.down, page.keyboard.up
        self._in_frame = False

    @property
    def shown(self):
        """What scripts run in: the page, or the one in its frame."""
        return self._page.frames[-1] if self._in_frame else self._page

    def _evaluate(self, expression):
        return self.shown.evaluate(expression)

    def enter_frame(self, inside=True):
        self._in_frame = inside

    def click(self, selector):
        self.shown.locator(selector).first.click()

    def stop(self, seconds):
        """Stop all processes of the browser for some time."""
        session = self._page.context.browser.new_browser_cdp_session()
        processes = [each["id"] for each in session.send("SystemInfo.getProcessInfo")["processInfo"]]
        _stop([lambda signal, process=process: os.kill(process, signal) for process in processes], seconds)

    def resize(self, width, height):
        self._page.set_viewport_size({"width": width, "height": height})

    def picture(self, selector):
        """PNG of a part of the page, with all that lies over it."""
        return self._page.locator(selector).screenshot()

    def hold(self, key, seconds=0.05):
        self._page.keyboard.press(key, delay=1000.0 * seconds)


class Firefox(Page):
    """One tab of a browser that listens at an address."""

    def __init__(self, socket, process):
        super().__init__()
        self._socket, self._process, self._count = socket, process, 0
        self._ask("session.new", capabilities={"alwaysMatch": {"acceptInsecureCerts": True}})
        # The first one never has the focus.
        self._tab = self._shown = self._ask("browsingContext.create", type="tab")["context"]
        self._ask("session.subscribe", events=EVENTS, contexts=[self._tab])

    def goto(self, url):
        self._ask("browsingContext.navigate", context=self._tab, url=url, wait="complete")

    def reload(self):
        self._ask("browsingContext.reload", context=self._tab, wait="complete")

    def resize(self, width, height):
        viewport = {"width": width, "height": height}
        self._ask("browsingContext.setViewport", context=self._tab, viewport=viewport)

    def prepare(self, script):
        """Run a script in every page before its own."""
        self._ask("script.addPreloadScript", functionDeclaration=f"() => {{ {script} }}")

    def enter_frame(self, inside=True):
        self._shown = self._tab
        if inside:
            self.wait_for("document.querySelector('iframe')")
            (tab,) = self._ask("browsingContext.getTree", root=self._tab)["contexts"]
            self._shown = tab["children"][0]["context"]

    def stop(self, seconds):
        """Stop all processes of the browser for some time."""
        _stop([lambda signal: os.killpg(self._process.pid, signal)], seconds)

    def click(self, selector):
        middle = MIDDLE.format(selector=json.dumps(selector))
        self.wait_for(middle)
        x, y = json.loads(self.evaluate(middle))
        move = {"type": "pointerMove", "x": round(x), "y": round(y)}
        press = [{"type": kind, "button": 0} for kind in ("pointerDown", "pointerUp")]
        mouse = [{"type": "pointer", "id": "mouse", "actions": [move, *press]}]
        self._ask("input.performActions", context=self._shown, actions=mouse)

    def _evaluate(self, expression):
        target = {"context": self._shown}
        answer = self._ask("script.evaluate", expression=expression, target=target, awaitPromise=True)
        return answer["result"].get("value")

    def down(self, key):
        self._act({"type": "keyDown", "value": KEYS.get(key, key)})

    def up(self, key):
        self._act({"type": "keyUp", "value": KEYS.get(key, key)})

    def hold(self, key, seconds=0.05):
        value = KEYS.get(key, key)
        pause = {"type": "pause", "duration": round(1000 * seconds)}
        self._act({"type": "keyDown", "value": value}, pause, {"type": "keyUp", "value": value})

    def _act(self, *actions):
        keys = [{"type": "key", "id": "keys", "actions": actions}]
        self._ask("input.performActions", context=self._shown, actions=keys)

    def _ask(self, method, **params):
        self._count += 1
        self._socket.send(json.dumps({"id": self._count, "method": method, "params": params}))
        while (answer := json.loads(self._socket.recv(timeout=PATIENCE))).get("id") != self._count:
            self._note(answer)
        assert answer["type"] != "error", f"{method}: {answer['message']}"
        return answer["result"]

    def _note(self, event):
        params = event.get("params", {})
        if event.get("method") == "network.beforeRequestSent":
            self.asked.append(params["request"]["url"])
        elif params.get("level") in ("error", "warn"):
            self.faults.append(params["text"])


def _stop(send, seconds):
    """Send SIGSTOP to processes and SIGCONT after some time; `send` has a function per process or group."""
    for each in send:
        each(signal.SIGSTOP)
    try:
        time.sleep(seconds)
    finally:
        for each in send:
            each(signal.SIGCONT)


@contextmanager
def firefox(profile, screen=None):
    """A Firefox on a screen, or else without one; `profile` is a new folder."""
    profile.mkdir()
    log = profile / "log.txt"
    words = ["--no-remote", "--remote-debugging-port", "0", "--profile", str(profile)]
    words += ["--headless"] if screen is None else []
    variables = {**os.environ, **({} if screen is None else {"DISPLAY": screen})}
    with (
        log.open("wb") as output,
        subprocess.Popen(
            [str(FIREFOX), *words], stdout=output, stderr=output, env=variables, start_new_session=True
        ) as process,
    ):
        try:
            until = time.monotonic() + PATIENCE
            while not (address := re.search(r"BiDi listening on (ws://\S+)", log.read_text())):
                assert process.poll() is None and time.monotonic() < until, log.read_text()
                time.sleep(0.1)
            with connect(f"{address[1]}/session", max_size=None, ping_interval=None) as socket:
                yield Firefox(socket, process)
        finally:  # a failed test must not wait for its browser
            process.kill()


@contextmanager
def virtual_screen():
    """Start an off-screen display and yield its name."""
    reading, writing = os.pipe()
    words = [XVFB, "-displayfd", str(writing), "-screen", "0", "1600x1000x24", "-nolisten", "tcp"]
    with subprocess.Popen(words, pass_fds=[writing], stderr=subprocess.DEVNULL) as process:
        os.close(writing)
        try:
            with os.fdopen(reading) as numbers:
                yield f":{numbers.readline().strip()}"
        finally:
            process.terminate()


def pass_story(page):
    """Press Enter on the welcome page, and on the story once its button has the focus."""
    page.hold("Enter")
    story = "document.querySelector('[name=phase][value=story]')"
    page.wait_for(f"{story} && document.activeElement.matches('button')")
    page.hold("Enter")
