"""A task done in Chromium by key events alone leaves a run that replays to the same metrics."""

import msgspec
import pytest

from benchmarks import play
from benchmarks.support.play_keys import CHROMIUM, play_by_keys
from benchmarks.support.play_server import PlayProcess
from experiments.house import House
from experiments.replaying.replay import replay
from experiments.runs import records


@pytest.mark.skipif(not CHROMIUM.is_file(), reason=f"no browser at {CHROMIUM}")
@pytest.mark.parametrize("assistance", ["none", "optimal"])
def test_an_object_is_put_away_by_keys(tmp_path, assistance):
    from playwright.sync_api import sync_playwright

    words = ("--objects", "1", "--assistance", assistance, *play.FAST)
    with PlayProcess(tmp_path / "visits", *words) as server, sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 640, "height": 480})
        run = play_by_keys(page, server, House.load(), 300.0)
        browser.close()
    metrics = msgspec.json.decode((run / records.METRICS).read_bytes())
    assert (metrics["ended"], metrics["delivered"]) == ("all delivered", 1)
    assert all(verdict.verified for verdict in replay(run).verdicts)
