"""Sessions that keep all that was shown."""

from dataclasses import dataclass
from typing import Any

from experiments.house import House
from experiments.runs.records import EventLog
from experiments.session.session import Session
from experiments.trials.setup import prepare_session, trial_episode
from experiments.trials.trial_config import TrialConfig
from hud.state import HudState
from mjsim.model.scene import compose
from mjsim.observation import Observation
from mjsim.world import World

SIZES = ((640, 480), (960, 720), (1920, 1080))


class Recorder:
    """A viewer that keeps what is shown, and draws nothing."""

    def __init__(self) -> None:
        self.shown: list[tuple[Observation, HudState]] = []

    def camera(self, world: World) -> None:  # noqa: ARG002 - a viewer
        return None

    def show(self, world: World, observation: Observation, hud_state: HudState) -> None:  # noqa: ARG002
        self.shown.append((observation, hud_state))


@dataclass(frozen=True)
class Played:
    """A session that is over, and what was shown at each control step."""

    session: Session
    world: World
    events: list[dict[str, Any]]
    shown: list[tuple[Observation, HudState]]

    def of(self, *kinds: str) -> list[dict[str, Any]]:
        return [event for event in self.events if event["event"] in kinds]

    def at(self, time: float) -> tuple[Observation, HudState]:
        """What was shown first at or after a time, s."""
        return next((o, s) for o, s in self.shown if o.time >= time - 1e-6)


def opened(
    house: House, assistance: str, viewer: Any = None, **options: Any
) -> tuple[Session, World, EventLog]:
    settings = {"objects": 6, "seed": 3, "fidelity": "event", "regret": False, **options}
    config = TrialConfig(assistance=assistance, **settings)
    scene, log = compose(trial_episode(config, house), house.catalogue), EventLog()
    session, world = prepare_session(config, house, scene, log, viewer)
    return session, world, log


def play(house: House, assistance: str, **options: Any) -> Played:
    recorder = Recorder()
    session, world, log = opened(house, assistance, recorder, **options)
    session.run()
    return Played(session, world, log.events, recorder.shown)
