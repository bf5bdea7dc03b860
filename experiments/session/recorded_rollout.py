"""Many control steps at once, recorded as if they had been observed one by one."""

import numpy as np
from numpy.typing import NDArray

from experiments.runs.recording import Recording
from experiments.runs.trajectory import Trajectory
from mjsim.observation import Observation
from mjsim.rollout import Rollout
from mjsim.world import World


def roll_out(
    world: World,
    now: Observation,
    moves: NDArray[np.float64] | None,
    recording: Recording,
    trajectory: Trajectory,
) -> Rollout:
    """Make many control steps, and record them.

    Args:
        world: The physics.
        now: The present state.
        moves: Forward, left (m/s), turn and look (rad/s) of every step, shape (n, 4); None to wait for the pick or
            place under way.
        recording: Takes hashes and checkpoints.
        trajectory: Takes poses and actions.
    """
    recording.append()
    health = world.health_sample
    rollout = world.finish() if moves is None else world.walk(moves)
    count = len(rollout)
    recording.extend(rollout.states.state_hashes[:-1])
    trajectory.extend(now, health, rollout, np.zeros((count, 4)) if moves is None else moves[:count])
    return rollout
