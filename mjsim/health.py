"""Whether the physics is well: warnings, penetration, weld errors and settling times."""

import dataclasses
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from mjsim.errors import PhysicsError


@dataclass(frozen=True)
class Health:
    """Extremes since the last reset.

    Attributes:
        max_penetration_m: Deepest overlap of an object with anything but the person, m, sampled once per control
            step. The person's foot is left out because it is soft on purpose: it pushes and never launches.
        max_trunk_penetration_m: Deepest overlap of the person's trunk with the house, m.
        max_weld_error_m: Largest distance between a hand and the grip it carries, m, alignment after a grip
            left out.
        settle_times: Seconds from each release to rest, in order.
        max_settle_time: The longest of them, s; 0 when nothing was released.
        warnings: Number of MuJoCo warnings; any one ends the simulation with a `PhysicsError`.
    """

    max_penetration_m: float = 0.0
    max_trunk_penetration_m: float = 0.0
    max_weld_error_m: float = 0.0
    settle_times: tuple[float, ...] = ()
    warnings: int = 0

    @property
    def max_settle_time(self) -> float:
        """Longest time from a release to rest, s."""
        return max(self.settle_times, default=0.0)


@dataclass
class HealthMonitor:
    """Accumulates `Health` over control steps."""

    foot: int
    trunk: int
    max_penetration: float = 0.0
    max_trunk_penetration: float = 0.0
    max_weld_error: float = 0.0
    settle_times: list[float] = field(default_factory=list)

    def check(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Record this control step.

        Raises:
            PhysicsError: MuJoCo warned, or a position or velocity is not finite.
        """
        if data.warning.number.any():
            raise PhysicsError(_warning_text(data))
        if not np.isfinite(np.dot(data.qvel, data.qvel) + np.dot(data.qpos, data.qpos)):
            raise PhysicsError(_not_finite_text(model, data))
        if data.ncon:
            geoms, depth = data.contact.geom, -data.contact.dist
            trunk = (geoms == self.trunk).any(axis=1)
            person = trunk | (geoms == self.foot).any(axis=1)
            self.max_penetration = max(self.max_penetration, float(depth.max(where=~person, initial=0.0)))
            deepest = float(depth.max(where=trunk, initial=0.0))
            self.max_trunk_penetration = max(self.max_trunk_penetration, deepest)

    def memory(self) -> dict[str, Any]:
        """Everything accumulated, JSON-ready."""
        return dataclasses.asdict(self)

    def snapshot(self, data: mujoco.MjData) -> Health:
        """The extremes as a value."""
        return Health(
            max_penetration_m=self.max_penetration,
            max_trunk_penetration_m=self.max_trunk_penetration,
            max_weld_error_m=self.max_weld_error,
            settle_times=tuple(self.settle_times),
            warnings=int(data.warning.number.sum()),
        )


def _warning_text(data: mujoco.MjData) -> str:
    kinds = np.flatnonzero(data.warning.number)
    found = ", ".join(
        f"{mujoco.mjtWarning(int(k)).name} (detail {int(data.warning.lastinfo[k])})" for k in kinds
    )
    return (
        f"MuJoCo warned at t = {data.time:.3f} s: {found}. The state is no longer trustworthy; reset the world, and "
        "replay the recorded actions up to this time to look at the cause"
    )


def _not_finite_text(model: mujoco.MjModel, data: mujoco.MjData) -> str:
    bad = np.flatnonzero(~np.isfinite(data.qvel))
    where = model.body(int(model.dof_bodyid[bad[0]])).name if bad.size else "a position"
    return (
        f"the state is not finite at t = {data.time:.3f} s, first at {where!r}; reset the world, and replay the "
        "recorded actions up to this time to look at the cause"
    )
