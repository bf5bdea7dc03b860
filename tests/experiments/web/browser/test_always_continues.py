"""Whatever happens to connection, tab or picture, a participant can continue and the clock stops meanwhile."""

import json
import socket
import threading
import time
from contextlib import contextmanager
from urllib.parse import urlsplit

import pytest

from benchmarks.play import FAST
from benchmarks.support.play_server import PATIENCE, TASK_ALONE, PlayProcess
from experiments.record.journal import JournalEntry, read_entries
from tests.experiments.web.browser.pages import Chromium

pytestmark = pytest.mark.slow
TITLE = "(document.getElementById('panel').open ? document.getElementById('panel-title').textContent : null)"
PLAYING = (
    "document.getElementById('play')?.dataset.phase === 'running' && !document.getElementById('panel').open"
)
CLOCK = "document.getElementById('clock').textContent.split(':').reduce((sum, part) => 60 * sum + Number(part), 0)"
STOP_S = 30.0  # how long a browser is stopped, in seconds
NOTICED_S = 5.0  # time within which the clock stops, and by which the shown time may be late, in seconds
FRAME = "document.getElementById('screen').toDataURL()"
# Loses the drawing context for a second, and notes all titles of dialogs meanwhile.
LOSS = f"""(() => {{
    const context = document.getElementById('world').getContext('webgl2');
    Object.assign(window, {{ loss: context.getExtension('WEBGL_lose_context'), titles: new Set() }});
    setInterval(() => titles.add({TITLE}), 50);
    setTimeout(() => loss.restoreContext(), 1000);
    loss.loseContext();
}})()"""

# Makes each frame that this browser draws take 0.2 s.
SLOW = """(() => {
    const request = window.requestAnimationFrame.bind(window);
    window.requestAnimationFrame = (draw) => request((time) => {
        for (const end = performance.now() + 200; performance.now() < end; );
        draw(time);
    });
})()"""


class MutableProxy:
    """A TCP proxy whose existing connections can be muted: their bytes disappear, and nothing is closed."""

    def __init__(self, url):
        self._target = (urlsplit(url).hostname, urlsplit(url).port)
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._muted, self._open = set(), set()
        self.url = f"http://127.0.0.1:{self._listener.getsockname()[1]}/"
        threading.Thread(target=self._accept, daemon=True).start()

    def mute(self):
        """Mute all connections of this moment; later ones work."""
        self._muted |= self._open

    def close(self):
        self._listener.close()

    def _accept(self):
        while True:
            try:
                browser, _ = self._listener.accept()
                server = socket.create_connection(self._target)
            except OSError:  # the proxy is closed, or the server has stopped
                return
            pair = (browser, server)
            self._open.add(pair)
            for source, target in (pair, pair[::-1]):
                threading.Thread(target=self._forward, args=(pair, source, target), daemon=True).start()

    def _forward(self, pair, source, target):
        try:
            while data := source.recv(65536):
                if pair not in self._muted:
                    target.sendall(data)
            if pair not in self._muted:
                target.shutdown(socket.SHUT_WR)
        except OSError:
            pass


@contextmanager
def task(tmp_path, draw):
    """A server of a task with one object, behind a proxy."""
    with PlayProcess(tmp_path / "visits", "--objects", "1", "--draw", draw, *TASK_ALONE, *FAST) as server:
        proxy = MutableProxy(server.url)
        try:
            yield server, proxy
        finally:
            proxy.close()


def begin(page, url):
    """Start the task."""
    page.goto(url)
    page.wait_for("document.activeElement?.matches('.button')")
    page.hold("Enter")
    page.wait_for(f"document.getElementById('panel') && {TITLE} === 'Your task'")
    page.click("#panel-actions .button")
    page.wait_for(PLAYING)


def remains(page, expression, seconds=5.0):
    """Assert that an expression stays true, not only at one moment."""
    assert stays(page, expression, seconds), page.evaluate(TITLE)


def settles(page, expression, seconds=5.0):
    """Wait until an expression stays true. Until then, only dialogs that close by themselves may be open."""
    until = time.monotonic() + PATIENCE
    while not stays(page, expression, seconds):
        assert page.evaluate(TITLE) in (None, "One moment", "No connection")
        assert time.monotonic() < until, page.evaluate(TITLE)


def stays(page, expression, seconds):
    """Return whether an expression is true for all of some seconds."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        if not page.evaluate(expression):
            return False
        time.sleep(0.2)
    return True


def pauses(journal):
    """Return the reasons of all pauses in a journal."""
    entries = (entry for entry in read_entries(journal) if isinstance(entry, JournalEntry))
    events = (json.loads(line) for entry in entries for line in entry.events)
    return [event["reason"] for event in events if event["event"] == "pause"]


def wait_for_loss(journal, earlier=0):
    """Wait for the pause of a lost picture, and return the number of pauses. `earlier` is their number before.

    A pause is written with the first control step after it. A slow page may have been paused as silent just before.
    """
    until = time.monotonic() + PATIENCE
    while len(reasons := pauses(journal)) == earlier:
        assert time.monotonic() < until, "the clock did not stop"
        time.sleep(0.2)
    assert reasons[earlier] in ("picture lost", "silent")
    return len(reasons)


@pytest.mark.long
@pytest.mark.parametrize(("browser", "draw"), [("chromium", "auto"), ("firefox", "server")])
def test_a_mute_connection_is_replaced_and_a_held_key_still_walks(tmp_path, request, browser, draw):
    page = request.getfixturevalue(f"{browser}_page")
    with task(tmp_path, draw) as (_, proxy):
        begin(page, proxy.url)
        page.down("ArrowLeft")
        proxy.mute()
        page.wait_for(f"{TITLE} === 'No connection'")
        settles(page, PLAYING, 3.0)
        if draw == "server":
            before = page.evaluate(FRAME)
            page.wait_for(f"{FRAME} !== {json.dumps(before)}")  # the view still turns
        page.up("ArrowLeft")


@pytest.mark.long
@pytest.mark.parametrize(("browser", "draw"), [("chromium", "auto"), ("firefox", "server")])
def test_a_browser_that_stops_for_30_s_continues_by_itself(tmp_path, request, browser, draw):
    page = request.getfixturevalue(f"{browser}_page")
    with task(tmp_path, draw) as (server, _):
        begin(page, server.url)
        page.wait_for(f"{CLOCK} > 1")
        before, began = page.evaluate(CLOCK), time.monotonic()
        page.stop(STOP_S)
        page.wait_for(PLAYING)
        page.wait_for(f"{CLOCK} > {before}")
        ran = page.evaluate(CLOCK) - before
        assert ran < time.monotonic() - began - STOP_S + NOTICED_S, (
            "the clock ran while the browser was stopped"
        )


@pytest.mark.long
@pytest.mark.parametrize("browser", ["chromium", "firefox"])
def test_a_browser_that_draws_slowly_lets_the_server_draw(tmp_path, request, browser):
    page = request.getfixturevalue(f"{browser}_page")
    with task(tmp_path, "auto") as (server, _):
        begin(page, server.url)
        page.evaluate(SLOW)
        drawn_by_server = f"document.getElementById('world').hidden && {PLAYING}"
        page.wait_for(drawn_by_server)
        settles(page, drawn_by_server)
        before = page.evaluate(CLOCK)
        page.wait_for(f"{CLOCK} > {before}")
        assert page.evaluate("!document.getElementById('redraw-button').hidden")


@pytest.mark.parametrize("other", ["tab", pytest.param("firefox_page", marks=pytest.mark.long)])
def test_a_page_that_was_taken_over_says_so_and_takes_back(tmp_path, request, chromium, other):
    with task(tmp_path, "server") as (server, _):
        context = chromium.new_context()
        first = Chromium(context.new_page())
        second = Chromium(context.new_page()) if other == "tab" else request.getfixturevalue(other)
        begin(first, server.url)
        second.goto(first.evaluate("location.href"))
        second.wait_for(f"{TITLE} === 'This session is open on another page'")
        second.click("#panel-actions .button")
        replaced = f"{TITLE} === 'This session continues on another page'"
        first.wait_for(replaced)
        second.wait_for(f"{TITLE} === 'Paused'")
        second.click("#panel-actions .button")
        second.wait_for(PLAYING)
        remains(first, replaced)
        first.click("#panel-actions .button")
        first.wait_for(
            f"document.getElementById('panel') && {TITLE} === 'This session is open on another page'"
        )
        first.click("#panel-actions .button")
        first.wait_for(f"{TITLE} === 'Paused'")
        first.click("#panel-actions .button")
        first.wait_for(PLAYING)
        remains(first, PLAYING, 2.0)
        second.wait_for(replaced)


@pytest.mark.parametrize(
    ("browser", "draw"),
    [
        ("chromium", "auto"),
        pytest.param("chromium", "browser", marks=pytest.mark.long),
        pytest.param("firefox", "auto", marks=pytest.mark.long),
        pytest.param("firefox", "browser", marks=pytest.mark.long),
    ],
)
def test_a_lost_picture_stops_the_clock_until_it_is_back(tmp_path, request, browser, draw):
    page = request.getfixturevalue(f"{browser}_page")
    page.resize(480, 270)  # drawn quickly: on a busy machine, a slow page would let the server draw
    with task(tmp_path, draw) as (server, _):
        begin(page, server.url)
        journal = server.journal(page.evaluate("location.href"), "task")
        page.evaluate(LOSS)
        page.wait_for("titles.has('One moment')")
        settles(page, PLAYING)
        shown = "document.getElementById('world').hidden"
        assert not page.evaluate(shown)
        stopped = wait_for_loss(journal)
        page.evaluate("loss.loseContext()")
        if draw == "auto":
            settles(page, f"{shown} && {PLAYING}")
            assert page.evaluate("!document.getElementById('redraw-button').hidden")
        else:
            undrawable = f"{TITLE} === 'This browser cannot draw the apartment'"
            page.wait_for(undrawable)
            before = page.evaluate(CLOCK)
            remains(page, undrawable)
            assert page.evaluate(CLOCK) == before, "the clock ran behind the dialog"
            page.click("#panel-actions .button")
            page.wait_for(f"document.getElementById('panel') && {TITLE} === 'Paused'")
            page.click("#panel-actions .button")
            page.wait_for(PLAYING)
        wait_for_loss(journal, stopped)
