"""Sessions that keep all that was shown."""

from dataclasses import dataclass
from typing import Any

from experiments.record.records import EventLog
from experiments.session.session import Session
from experiments.trials.setup import prepare_session, trial_episode
from experiments.trials.trial_config import TrialConfig
from hud.state import HudState
from mjsim.house.scene.scene import compose
from mjsim.values.observation import Observation
from mjsim.world.world import World

SIZES = ((640, 480), (960, 720), (1920, 1080))


class Recorder:
    """A viewer that keeps what is shown, and draws nothing."""

    def __init__(self):
        self.shown: list[tuple[Observation, HudState]] = []

    def camera(self, world):  # noqa: ARG002 - a viewer
        return None

    def show(self, world, observation, hud_state):  # noqa: ARG002
        self.shown.append((observation, hud_state))


@dataclass(frozen=True)
class Played:
    """A session that is over, and what was shown at each control step."""

    session: Session
    world: World
    events: list[dict[str, Any]]
    shown: list[tuple[Observation, HudState]]

    def of(self, *kinds):
        return [event for event in self.events if event["event"] in kinds]

    def at(self, time):
        """What was shown first at or after a time, s."""
        return next((o, s) for o, s in self.shown if o.time >= time - 1e-6)

    def lay(self, visit):
        """Where the object of a visit was last before it was picked up, m, (2,)."""
        name = visit["object"]
        last = [o for o, _ in self.shown if o.time < visit["t"] - 1e-6 and name not in o.carried][-1]
        return last.object_positions[last.object_names.index(name), :2]


def prepared(house, config, viewer=None, **options):
    """A session, its world and its log."""
    scene, log = compose(trial_episode(config, house), house.catalogue), EventLog()
    session, world = prepare_session(config, house, scene, log, viewer, **options)
    return session, world, log


def opened(house, assistance, viewer=None, **options):
    settings = {"objects": 6, "seed": 3, "fidelity": "event", "regret": False, **options}
    return prepared(house, TrialConfig(assistance=assistance, **settings), viewer)


def play(house, assistance, **options):
    recorder = Recorder()
    session, world, log = opened(house, assistance, recorder, **options)
    session.run()
    return Played(session, world, log.events, recorder.shown)
