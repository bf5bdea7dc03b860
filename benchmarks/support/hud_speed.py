"""What drawing the HUD costs in a real session: every HUD state of one trial is drawn in turn.

python -m benchmarks.support.hud_speed --assistance optimal --objects 6
"""

import argparse
import time
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from experiments.house import House
from experiments.record.records import EventLog
from experiments.trials.setup import prepare_session, trial_episode
from experiments.trials.trial_config import TrialConfig
from hud.compose import Compositor
from hud.projection import CameraView
from hud.state import FLOORPLAN, HudState
from mjsim.house.scene.scene import compose
from mjsim.render import render_house_map, render_pictures
from mjsim.render.cameras import camera_pose
from mjsim.values.observation import Observation
from mjsim.world.world import World

SIZE = (640, 480)
# Bytes written between two frames, as rendering does, so that no processor cache still holds the panels.
BETWEEN_FRAMES = 16 << 20


class _Recorder:
    """A viewer that keeps the HUD states and draws nothing."""

    def __init__(self) -> None:
        self.states: list[HudState] = []

    def camera(self, world: World) -> CameraView:
        """The eye camera."""
        pose = camera_pose(world.model, world.data, "avatar/eye", SIZE[0] / SIZE[1])
        return CameraView(pose.position, pose.rotation, pose.fovy, *SIZE)

    def show(self, world: World, observation: Observation, hud_state: HudState) -> None:  # noqa: ARG002
        """Keep the state of this control step."""
        self.states.append(hud_state)


def session_states(house: House, trial: TrialConfig) -> tuple[HudState, ...]:
    """The states of a trial, one per control step."""
    scene = compose(trial_episode(trial, house), house.catalogue)
    recorder = _Recorder()
    session, _ = prepare_session(trial, house, scene, EventLog(), recorder)
    session.run()
    return tuple(recorder.states)


def hud_milliseconds(
    compositor: Compositor,
    states: Sequence[HudState],
    size: tuple[int, int] = SIZE,
    clock: Callable[[], float] = time.process_time,
) -> NDArray[np.float64]:
    """What it takes to lay each of `states` over a frame, in order, ms, shape (states,).

    Args:
        compositor: Draws them; what it keeps from frame to frame is part of what is measured.
        states: Of a session.
        size: Width and height of the frame, px.
        clock: Counts seconds.
    """
    frame = np.random.default_rng(0).integers(0, 256, (size[1], size[0], 3), dtype=np.uint8)
    elsewhere = np.zeros(BETWEEN_FRAMES, np.uint8)
    times = np.empty(len(states))
    for i, state in enumerate(states):
        elsewhere += 1
        start = clock()
        compositor.compose(frame, state)
        times[i] = clock() - start
    return 1e3 * times


def summary(times: NDArray[np.float64]) -> dict[str, float]:
    """Mean, median, 99th percentile and maximum of times (frames,), ms, without the first; and the first, ms."""
    later = times[1:]
    return {
        "frames": len(times),
        "mean_ms": float(later.mean()),
        "median_ms": float(np.median(later)),
        "p99_ms": float(np.percentile(later, 99)),
        "max_ms": float(later.max()),
        "first_ms": float(times[0]),
    }


def main() -> None:
    """Print the cost for one trial."""
    parser = argparse.ArgumentParser(description="Measure what drawing the HUD costs in a real session.")
    parser.add_argument("--assistance", default="optimal")
    parser.add_argument("--objects", type=int, default=6)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--width", type=int, default=SIZE[0])
    parser.add_argument("--height", type=int, default=SIZE[1])
    given = parser.parse_args()
    house = House.load()
    states = session_states(
        house, TrialConfig(objects=given.objects, assistance=given.assistance, seed=given.seed)
    )
    pictures = render_pictures(house.catalogue)
    pictures[FLOORPLAN] = render_house_map(house.catalogue, house.bounds)
    found = summary(hud_milliseconds(Compositor(pictures, house.texts), states, (given.width, given.height)))
    for name, value in found.items():
        Console().print(f"{name:10} {value:8.2f}" if name != "frames" else f"{name:10} {value:5.0f}")


if __name__ == "__main__":
    main()
