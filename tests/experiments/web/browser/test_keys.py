"""A task done by key events alone, in a browser that draws, leaves a run that replays to the same metrics."""

import os

import msgspec
import pytest

from benchmarks.play import FAST
from benchmarks.support.play_server import PlayProcess
from experiments.house import House
from experiments.record import records
from experiments.record.records import read_events
from experiments.trials.replay.replay import replay
from experiments.trials.setup import trial_episode
from experiments.trials.trial_config import TrialConfig
from hud.conditions import CONDITIONS
from tests.experiments.web.browser.key_presser import WATCH, KeyPresser, choose
from tests.experiments.web.browser.pages import pass_story

pytestmark = [pytest.mark.slow, pytest.mark.long]

HARMLESS = (  # said where there is no graphics card, or because a test asks
    "KHR_parallel_shader_compile",
    "GL Driver Message",
)
FEW = [("chromium", 6, "none"), ("firefox", 6, "optimal")]
MANY = [(browser, 6, name) for browser in ("chromium", "firefox") for name in CONDITIONS]
CASES = MANY if "MJSIM_ALL_CONDITIONS" in os.environ else FEW


@pytest.mark.parametrize(("browser", "objects", "assistance"), CASES)
def test_objects_are_put_away_by_keys(tmp_path, request, browser, objects, assistance):
    page = request.getfixturevalue(f"{browser}_page")
    words = ("--objects", str(objects), "--assistance", assistance, *FAST)
    house = House.load()
    episode = trial_episode(TrialConfig(objects=objects, assistance=assistance, seed=0), house)
    page.prepare(WATCH)
    page.resize(640, 480)
    with PlayProcess(tmp_path / "visits", *words) as server:
        page.goto(server.url)
        pass_story(page)
        page.wait_for("document.querySelector('[data-trial]')")
        address = page.evaluate("location.href")
        page.goto(f"{address}?draw=browser")  # however slowly
        choose(page, "Skip the training")
        choose(page, "Start")
        page.wait_for("document.querySelectorAll('#list li').length > 0")
        page.hold("p")
        page.wait_for("document.getElementById('panel-title').textContent === 'Paused'")
        page.reload()
        choose(page, "Continue")
        KeyPresser(page, house, episode).tidy()
        run = server.visit(address) / "task"
    assert [fault for fault in page.faults if not any(words in fault for words in HARMLESS)] == []
    assert [asked for asked in page.asked if not asked.startswith((server.url, "blob:", "data:"))] == []
    metrics = msgspec.json.decode((run / records.METRICS).read_bytes())
    assert (metrics["ended"], metrics["delivered"]) == ("all delivered", objects)
    assert all(verdict.verified for verdict in replay(run).verdicts)
    events = read_events(run / "events.jsonl")
    assert {event["draw"] for event in events if event["event"] == "display"} == {"browser"}
    ended = [event for event in events if event["event"] == "phase_ended"]
    assert [event["phase"] for event in ended] == ["story", "training"]
    assert all(event["duration_s"] > 0.0 for event in ended[:1])
