"""docs/protocol.md suffices to write a client: one that was written by it does a task, whose run replays."""

import asyncio

import pytest

from benchmarks.play import FAST
from benchmarks.support.play_server import PlayProcess
from experiments.record import records
from experiments.record.files import read_json
from experiments.trials.replay.replay import replay
from tests.experiments.web.other_client import OtherClient, begin_visit

MOVED = 0.3  # m between two snapshots, which nobody walks


@pytest.mark.slow
@pytest.mark.parametrize("delay", [pytest.param(0.0, marks=pytest.mark.long), 0.1])
def test_another_client_does_a_task(tmp_path, delay):
    words = ("--objects", "1", "--assistance", "guided", "--phases", "task", *FAST)
    with PlayProcess(tmp_path / "visits", *words) as server:
        client = OtherClient(begin_visit(server.url), delay)
        asyncio.run(asyncio.wait_for(play(client), 400.0))
        run = server.visit(client._address) / "task"
    metrics = read_json(run / records.METRICS)
    assert (metrics["ended"], metrics["delivered"]) == ("all delivered", 1)
    report = replay(run)
    assert all(verdict.verified for verdict in report.verdicts)
    steps = sorted(client.snapshots)
    assert list(client.snapshots) == steps, "in order; a late server leaves some out"
    assert client.refused == [] and set(client.models) == {"object_00"}
    overruns = [
        e for e in records.read_events(run / "events.jsonl") if e["event"] == "overrun" and e["missing"]
    ]
    for step in steps if not overruns else ():
        counted = max((number for number, stamp in client.stamps.items() if stamp < step), default=0)
        assert client.snapshots[step]["input"] == counted, "each input counts at its step"


async def play(client):
    """Play, and load the scene meanwhile as a page does."""
    playing = asyncio.create_task(client.play())
    await client._until(lambda: client._scene is not None)
    files = await client.load()
    assert files["house.glb"][:4] == b"glTF" and files["floor"]["edges"]
    await playing
