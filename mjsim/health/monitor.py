"""Looks at the physics after every control step: warnings, penetration, weld errors, settling times and escapes.

`docs/health.md` defines every term. What cannot be trusted any further is a `PhysicsError`; what can be is counted,
and reported as an event.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from mjsim.actions import EventKind
from mjsim.errors import PhysicsError
from mjsim.health.anomalies import (
    MOVED_DISTANCE,
    AnomalyDetector,
    AnomalyState,
    Releases,
    ReleasesState,
)
from mjsim.health.scan import ESCAPING, NOT_FINITE, WARNED, survey
from mjsim.health.values import QUIET, Health, HealthSample
from mjsim.model.clearance import carry_clearance
from mjsim.model.scene import Scene
from mjsim.options import WorldOptions
from mjsim.person.grips import Grips
from mjsim.person.rig import Rig

_KICK = 2.0  # times the walking speed: a light thing that bounces off somebody who walks into it
_FALL = 5.6  # m/s, from the height at which things are carried


@dataclass(frozen=True, eq=False)
class HealthState:
    """What a `HealthMonitor` has accumulated, as a value.

    Attributes:
        extremes: Deepest overlap of an object and of the trunk, m; largest weld error, m and rad.
        settle_times: See `Health.settle_times`.
        sample: The latest control step.
        anomalies: Objects that flew off or passed through something.
        releases: Objects between release and rest.
    """

    extremes: tuple[float, float, float, float]
    settle_times: tuple[float, ...]
    sample: HealthSample
    anomalies: AnomalyState
    releases: ReleasesState


class HealthMonitor:
    """Accumulates `Health` over control steps.

    Attributes:
        sample: What the latest control step was like.
    """

    def __init__(self, scene: Scene, options: WorldOptions, rig: Rig, grips: Grips) -> None:
        index = scene.index
        self._index, self._rig, self._grips = index, rig, grips
        self._limits = (
            np.array([MOVED_DISTANCE, _FALL + _KICK * options.max_speed, options.settle_speed]) ** 2
        )
        self._marks = np.zeros(len(index.names), np.uint8)
        self._sample = np.zeros(6)
        self._field, self._rooms = carry_clearance(scene).arrays, scene.rooms.rectangles
        self._escapes = AnomalyDetector(scene)
        self._releases = Releases(scene)
        self.reset()

    def reset(self) -> None:
        """Forget everything; the state is that of the beginning."""
        self._deepest = self._deepest_trunk = self._stretched = self._twisted = 0.0
        self._settle_times: list[float] = []
        self.sample = QUIET
        self._escapes.reset(self._rig.data)
        self._releases.reset()

    def check(self, held: Sequence[int | None]) -> Sequence[tuple[EventKind, int]]:
        """Record this control step.

        Args:
            held: Object that each hand carries.

        Returns:
            AnomalyDetector of objects, each with the object's number.

        Raises:
            PhysicsError: MuJoCo warned, or a position or velocity is not finite.
        """
        data = self._rig.data
        escaping = self._survey(data, held)
        deepest, trunk, left, right, left_angle, right_angle = self._sample.tolist()
        self._deepest, self._deepest_trunk = max(self._deepest, deepest), max(self._deepest_trunk, trunk)
        # NaN loses every comparison, and so the second place in a maximum.
        self._stretched = max(self._stretched, left, right)
        self._twisted = max(self._twisted, left_angle, right_angle)
        gripped = self._grips.gripped
        settle = math.nan
        if gripped or self._releases.any:
            settled = self._releases.follow(data, gripped, self._marks)
            self._settle_times += settled
            settle = max(settled, default=math.nan)
        self.sample = HealthSample(deepest, trunk, (left, right), (left_angle, right_angle), settle)
        if not escaping and not self._releases.falling:
            return ()
        return self._escapes.find(data, self._marks, self._releases, gripped)

    def resume(self) -> None:
        """Go on after something else than physics has moved the person and what the hands hold."""
        self._escapes.resume(self._rig.data)

    def get_state(self) -> HealthState:
        """Everything accumulated, as a value."""
        return HealthState(
            extremes=(self._deepest, self._deepest_trunk, self._stretched, self._twisted),
            settle_times=tuple(self._settle_times),
            sample=self.sample,
            anomalies=self._escapes.get_state(),
            releases=self._releases.get_state(),
        )

    def set_state(self, state: HealthState) -> None:
        """Go on from what `get_state` gave."""
        self._deepest, self._deepest_trunk, self._stretched, self._twisted = state.extremes
        self._settle_times = list(state.settle_times)
        self.sample = state.sample
        self._escapes.set_state(state.anomalies)
        self._releases.set_state(state.releases)

    def snapshot(self) -> Health:
        """The extremes as a value."""
        return Health(
            max_penetration_m=self._deepest,
            max_trunk_penetration_m=self._deepest_trunk,
            max_weld_error_m=self._stretched,
            max_weld_error_rad=self._twisted,
            settle_times=tuple(self._settle_times),
            ejections=self._escapes.ejections,
            tunnellings=self._escapes.tunnellings,
            warnings=int(self._rig.data.warning.number.sum()),
        )

    def _survey(self, data: mujoco.MjData, held: Sequence[int | None]) -> bool:
        """Whether any object may be escaping; samples and marks everything."""
        index, rig, contact = self._index, self._rig, data.contact
        state = survey(
            data.qpos, data.qvel, data.xipos, data.site_xpos, data.site_xmat, contact.geom, contact.dist,
            data.warning.number, index.bodies, index.dofs, index.geom_owner, rig.trunk, rig.foot, self._limits,
            self._grips.pairs, held[0] is not None, held[1] is not None, self._field, self._rooms,
            self._escapes.anchors, self._marks, self._sample,
        )  # fmt: skip
        if state == WARNED:
            raise PhysicsError(_warning_text(data))
        if state == NOT_FINITE:
            raise PhysicsError(_not_finite_text(rig.model, data))
        return bool(state == ESCAPING)


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
