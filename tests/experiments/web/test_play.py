"""`mjsim play` as it is started: real workers, real sockets."""

import asyncio
import signal

import pytest

from benchmarks.play import FAST
from benchmarks.support.play_browser import SimulatedBrowser
from benchmarks.support.play_server import PATIENCE, PlayProcess, worker_of
from experiments.cli.main import main
from experiments.record.records import read_events
from experiments.replay.replay import replay


async def play(server):
    """Play a training that outlives its server; its run directory."""
    browser = SimulatedBrowser(server.begin(), snapshots=True)
    await browser.open("training")
    await browser.run()
    for values in ({"forward": 1.0, "yaw": 0.5}, {"forward": 0.0}):
        browser.press(**values)
    await browser.taken()
    worker = worker_of(server.journal(browser.address, "training"))
    server.kill()
    await browser.cut()
    server.start()
    await browser.open("training")
    await browser.until(lambda: browser.phase == "paused")
    assert browser.last["state"]["reason"] == "disconnected" and browser.last["state"]["input"] == 2
    assert worker_of(server.journal(browser.address, "training")) != worker
    assert await browser.run() == 2
    browser.say(type="blur", away=True)
    browser.press(turn=1.0)
    await browser.taken()
    assert browser.last["snapshot"]["hud"]["checklist"]
    await browser.leave()
    return server.visit(browser.address) / "training"


def test_a_session_outlives_its_server_which_leaves_no_process_behind(tmp_path):
    with PlayProcess(tmp_path / "visits", "--objects", "2", *FAST) as server:
        run = asyncio.run(play(server))
        server.process.send_signal(signal.SIGTERM)
        server.process.communicate(timeout=PATIENCE)  # until its workers have closed its output as well
        assert server.process.returncode == 128 + signal.SIGTERM
    assert replay(run).steps > 0
    assert '"ended":"interrupted"' in (run / "metrics.json").read_text().replace(": ", ":")
    events = read_events(run / "events.jsonl")
    assert [event["reason"] for event in events if event["event"] == "pause"] == ["disconnected"]
    assert [event["away"] for event in events if event["event"] == "blur"] == [True]


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["--user", "follower"], "belongs to `mjsim run`"),
        (["--assistance", "nonsense"], "no assistance condition"),
        (["--objects", "0"], "objects is 0"),
        (["--port", "70000"], "not a number from 0 to 65535"),
        (["--sessions", "0"], "not a number from 1"),
        (["--film", "nothing.mp4"], "there is no film"),
        (["--public-url", "ftp://x"], "must be of the form"),
        (["--host", "no.such.host.invalid"], "name another --port (0 for any) or --host"),
    ],
)
def test_bad_options_are_named_in_one_line(tmp_path, capsys, words, text):
    try:
        code = main(["play", "--no-open", "--out", str(tmp_path / "out"), "--port", "0", *words])
    except SystemExit as stop:
        code = stop.code
    error = capsys.readouterr().err
    assert code in (1, 2) and text in error and error.count("\n") == 1
