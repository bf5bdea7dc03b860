"""Measure the time for drawing the HUD, with all HUD states of a real trial.

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
# Bytes written between two frames so that the HUD panels leave the processor's cache, as rendering would do
BETWEEN_FRAMES = 16 << 20


class _Recorder:
    """A viewer that only records the HUD states."""

    def __init__(self) -> None:
        self.states: list[HudState] = []

    def camera(self, world: World) -> CameraView:
        pose = camera_pose(world.model, world.data, "avatar/eye", SIZE[0] / SIZE[1])
        return CameraView(pose.position, pose.rotation, pose.fovy, *SIZE)

    def show(self, world: World, observation: Observation, hud_state: HudState) -> None:  # noqa: ARG002
        self.states.append(hud_state)


def session_states(house: House, trial: TrialConfig) -> tuple[HudState, ...]:
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
    """Measure the time in ms for drawing each HUD state over a frame, shape (states,).

    Args:
        compositor: The compositor that draws the states. Its caches persist from one state to the next.
        states: HUD states of a session, in order.
        size: Width and height of the frame in pixels.
        clock: A function that returns seconds.
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
    """Summarize times (frames,) in ms. The first frame is reported separately."""
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
