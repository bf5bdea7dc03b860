"""`mjsim play` as it is started: real workers, real sockets, a real browser."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import pytest
from websockets.sync.client import connect

from benchmarks.support.play_server import worker_of
from experiments.replaying.replay import replay
from experiments.runs.records import read_events

CHROMIUM = Path("/usr/bin/chromium")
PATIENCE_AT_END = 20.0  # s; less than a worker waits for another server
PATIENCE = 400.0  # s; a busy machine may have to compile all kernels first


@contextmanager
def server(folder, port=0):
    """A server; its process and URL."""
    words = [
        "play",
        "--no-open",
        "--objects",
        "2",
        "--fidelity",
        "event",
        "--port",
        str(port),
        "--out",
        str(folder),
    ]
    with subprocess.Popen(
        [sys.executable, "-m", "mjsim", *words], stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            url = process.stdout.readline().strip()
            assert url.startswith("http://127.0.0.1:"), "the URL stands on a line of its own"
            yield process, url
        finally:
            process.terminate()


def begin(url):
    """Begin a visit; its address."""
    origin = url.rstrip("/")
    answer = httpx.post(f"{origin}/visits", headers={"Origin": origin}, timeout=PATIENCE)
    return origin + answer.headers["location"]


class Player:
    """A browser's side of the socket."""

    def __init__(self, address, phase="training"):
        parts = urlsplit(address)
        self._connection = connect(f"ws://{parts.netloc}{parts.path}", origin=f"http://{parts.netloc}")
        self._socket = self._connection.__enter__()
        view = {"type": "view", "width": 640, "height": 480, "codec": "none", "state": True}
        self.say(type="hello", tab="tab-00000001", phase=phase, view=view)

    def say(self, **message):
        self._socket.send(json.dumps(message))

    def hear(self, kind, **values):
        """The next message of a type with these values."""
        while True:
            message = json.loads(self._socket.recv(timeout=PATIENCE))
            if message["type"] == kind and all(message[name] == value for name, value in values.items()):
                return message

    def press(self, number, **values):
        self.say(type="inputs", inputs=[{"number": number, **values}])
        self.hear("taken", input=number)


def test_a_session_survives_its_worker_and_its_server(tmp_path):
    with server(tmp_path) as (process, url):
        address, port = begin(url), urlsplit(url).port
        player = Player(address)
        player.hear("ready")
        player.say(type="begin")
        player.press(1, forward=1.0, yaw=0.5)
        player.press(2, forward=0.0)
        (journal,) = tmp_path.glob("*/journals/training/journal.bin")
        os.kill(worker_of(journal), signal.SIGKILL)
        ready = player.hear("ready")
        assert ready["resumed"] and ready["input"] == 2
        player.press(3, turn=1.0)
        worker = worker_of(journal)
        process.kill()
        process.wait()
    with server(tmp_path, port) as (process, _):
        player = Player(address)
        ready = player.hear("ready")
        assert ready["resumed"] and ready["input"] == 3
        assert worker_of(journal) == worker, "a worker outlives its server"
        assert player.hear("paused")["reason"] == "disconnected"
        player.say(type="resume")
        player.say(type="blur", away=True)
        player.press(4, turn=0.0)
        player.say(type="leave")
        player.hear("over", reason="interrupted")
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=PATIENCE) == 128 + signal.SIGTERM
        until = time.monotonic() + PATIENCE_AT_END
        while Path(f"/proc/{worker}").exists():
            assert time.monotonic() < until, "a server that ends by itself leaves no worker behind"
            time.sleep(0.05)
    (run,) = tmp_path.glob("*/training")
    report = replay(run)
    assert report.steps > 0
    events = read_events(run / "events.jsonl")
    assert [event["reason"] for event in events if event["event"] == "pause"] == ["disconnected"]
    assert [event["away"] for event in events if event["event"] == "blur"] == [True]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--user", "follower"], "belongs to `mjsim run`"),
        (["--assistance", "nonsense"], "no assistance condition"),
        (["--objects", "0"], "objects is 0"),
        (["--port", "70000"], "is not a port"),
        (["--sessions", "0"], "not a number from 1"),
        (["--film", "nothing.mp4"], "there is no film"),
        (["--public-url", "ftp://x"], "must be of the form"),
        (["--host", "no.such.host.invalid"], "name another --host"),
    ],
)
def test_bad_options_are_named_in_one_line(tmp_path, capsys, words, said):
    from experiments.cli import main

    try:
        code = main(["play", "--no-open", "--out", str(tmp_path / "out"), "--port", "0", *words])
    except SystemExit as stop:
        code = stop.code
    error = capsys.readouterr().err
    assert code in (1, 2) and said in error and error.count("\n") == 1


def picture(page):
    return page.evaluate("document.getElementById('screen').toDataURL()")


@pytest.mark.skipif(not CHROMIUM.is_file(), reason=f"no browser at {CHROMIUM}")
def test_a_browser_plays_by_keys(tmp_path):
    from playwright.sync_api import sync_playwright

    with server(tmp_path) as (_, url), sync_playwright() as play:
        browser = play.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 640, "height": 480})
        page.set_default_timeout(1000 * PATIENCE)
        faults, asked = [], []
        page.on(
            "console", lambda said: faults.append(said.text) if said.type in ("error", "warning") else None
        )
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.on("request", lambda request: asked.append(request.url))
        page.goto(url)
        page.keyboard.press("Enter")  # the button has the focus
        page.wait_for_url("**/play/*")
        page.get_by_role("button", name="Start the training").press("Enter")
        page.locator("#list li").first.wait_for(state="attached")
        page.keyboard.press("e")
        page.locator("#said", has_text="You picked up").wait_for(state="attached")
        before = picture(page)
        page.keyboard.down("ArrowLeft")
        while picture(page) == before:
            page.wait_for_timeout(50)
        page.keyboard.up("ArrowLeft")
        page.keyboard.press("h")
        page.get_by_role("heading", name="Keys").wait_for()
        page.keyboard.press("h")
        page.keyboard.press("p")
        page.get_by_role("heading", name="Paused").wait_for()
        page.reload()
        page.get_by_role("button", name="Go on").press("Enter")
        page.get_by_role("button", name="End", exact=True).press("Enter")
        page.get_by_role("button", name="End the training").press("Enter")
        page.get_by_role("button", name="Start", exact=True).press("Enter")
        page.get_by_role("button", name="End", exact=True).press("Enter")
        page.get_by_role("button", name="End the task").press("Enter")
        page.get_by_role("heading", name="Your result").wait_for()
        browser.close()
    assert not faults
    assert all(address.startswith(url) for address in asked if not address.startswith("blob:"))
    (run,) = tmp_path.glob("*/task")
    assert replay(run).steps > 0
    ended = [event for event in read_events(run / "events.jsonl") if event["event"] == "phase_ended"]
    assert [event["phase"] for event in ended] == ["story", "training"]
    assert all(event["duration_s"] > 0.0 for event in ended)
