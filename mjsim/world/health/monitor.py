"""A monitor that checks the physics simulation for problems after every control step.

docs/metrics.md defines all terms. An invalid state raises a `PhysicsError`. All other problems are counted or
measured, and ejections and tunnelling are also reported as events.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.scene.scene import Scene
from mjsim.values.actions import EventKind
from mjsim.values.errors import PhysicsError
from mjsim.values.options import WorldOptions
from mjsim.world.body.grips import Grips
from mjsim.world.body.rig import Rig
from mjsim.world.health.anomalies import CHECK_DISTANCE, AnomalyDetector, AnomalyState
from mjsim.world.health.scan import NOT_FINITE, SUSPECT, WARNED, ScanArrays, scan, static_boxes
from mjsim.world.health.settle_times import SettleTimer, SettleTimerState

_KICK = 2.0  # maximum speed of a light object kicked by a walking person, as a multiple of the walking speed
_FALL = 5.6  # speed after a fall from the height at which objects are carried, in m/s
_NO_GEOMS, _NO_DISTANCES = np.zeros((0, 2), np.int32), np.zeros(0)
Pair = tuple[float, float]
NOTHING: Pair = (math.nan, math.nan)


class HealthSample(NamedTuple):
    """Measurements of physics problems in one control step.

    Attributes:
        penetration_m: Deepest overlap of an object with anything except the person, in metres. Contacts with
            the person's foot do not count, because the foot is soft by design.
        trunk_penetration_m: Deepest overlap of the person's trunk with the house, in metres.
        weld_error_m: Distance in metres between each hand and the grip in it, or NaN for an empty hand.
        weld_error_rad: Angle in radians between each hand and the grip in it, or NaN for an empty hand.
        settle_s: Longest settle time of the objects that came to rest in this step, in seconds, or NaN.
    """

    penetration_m: float = 0.0
    trunk_penetration_m: float = 0.0
    weld_error_m: Pair = NOTHING
    weld_error_rad: Pair = NOTHING
    settle_s: float = math.nan

    @property
    def row(self) -> tuple[float, ...]:
        """The sample as seven numbers, in the order of the attributes, with the left hand first."""
        overlaps = (self.penetration_m, self.trunk_penetration_m)
        return (*overlaps, *self.weld_error_m, *self.weld_error_rad, self.settle_s)


@dataclass(frozen=True)
class Health:
    """Maxima and counts of physics problems since the last reset.

    Attributes:
        settle_times: Time in seconds that each released object took to come to rest, in order.
        ejections: Number of objects that flew off, left the house, or moved faster than is plausible.
        tunnellings: Number of times that an object passed through a solid geom.
        warnings: Number of MuJoCo warnings. Any warning ends the simulation with a `PhysicsError`.
    """

    max_penetration_m: float = 0.0
    max_trunk_penetration_m: float = 0.0
    max_weld_error_m: float = 0.0
    max_weld_error_rad: float = 0.0
    settle_times: tuple[float, ...] = ()
    ejections: int = 0
    tunnellings: int = 0
    warnings: int = 0


@dataclass(frozen=True, eq=False)
class HealthState:
    """The state of a `HealthMonitor`."""

    # Maximum overlaps of objects and of the trunk (metres), and weld errors (metres and radians), shape (4,).
    extremes: NDArray[np.float64]
    settle_times: tuple[float, ...]  # see `Health.settle_times`
    sample: HealthSample  # measurements in the latest control step
    anomalies: AnomalyState
    settling: SettleTimerState


class HealthMonitor:
    """A monitor that updates the values of `Health` after each control step.

    Attributes:
        sample: Measurements in the latest control step.
    """

    def __init__(self, scene: Scene, options: WorldOptions, rig: Rig, grips: Grips) -> None:
        index, data = scene.index, rig.data
        self._rig, self._grips = rig, grips
        self._anomalies = AnomalyDetector(scene)
        self._settling = SettleTimer(scene)
        self._flags, self._sample = np.zeros(len(index.names), np.uint8), np.zeros(6)
        self._extremes = np.zeros(4)
        limits = (
            np.array([CHECK_DISTANCE, _FALL + _KICK * scene.person.fastest_walk, options.settle_speed]) ** 2
        )
        arrays = ScanArrays(
            qpos=data.qpos,
            qvel=data.qvel,
            xipos=data.xipos,
            site_xpos=data.site_xpos,
            site_xmat=data.site_xmat,
            warnings=data.warning.number,
            bodies=index.bodies,
            dofs=index.dofs,
            geom_owner=index.geom_owner,
            trunk=rig.trunk,
            foot=rig.foot,
            limits=limits,
            boxes=static_boxes(scene),
            rooms=scene.rooms.rectangles,
            grip_sites=grips.sites,
            anchors=self._anomalies.anchors,
            flags=self._flags,
            sample=self._sample,
            extremes=self._extremes,
        )
        self._arrays = tuple(arrays)
        self.reset()

    def reset(self) -> None:
        self._extremes[:] = 0.0
        self._settle_times: list[float] = []
        self.sample = QUIET
        self._anomalies.reset(self._rig.data)
        self._settling.reset()

    def check(self, held: Sequence[int | None]) -> Sequence[tuple[EventKind, int]]:
        """Check the latest control step. Return an event for each ejected or tunnelling object, with its index.

        Raises:
            PhysicsError: MuJoCo reported a warning, or a position or velocity is not finite.
        """
        data = self._rig.data
        suspect = self._scan(data, held)
        deepest, trunk, left, right, left_angle, right_angle = self._sample.tolist()
        gripped, settling = self._grips.gripped, self._settling
        settled = settling.update(data, gripped, self._flags)
        self._settle_times += settled
        settle = max(settled, default=math.nan)
        self.sample = HealthSample(deepest, trunk, (left, right), (left_angle, right_angle), settle)
        if not suspect and not settling.objects:
            return ()
        return self._anomalies.find(data, self._flags, settling.objects, gripped)

    def resume(self) -> None:
        """Take the current positions as correct after the person and held objects were moved without physics."""
        self._anomalies.move_anchors(self._rig.data)

    def get_state(self) -> HealthState:
        return HealthState(
            extremes=self._extremes.copy(),
            settle_times=tuple(self._settle_times),
            sample=self.sample,
            anomalies=self._anomalies.get_state(),
            settling=self._settling.get_state(),
        )

    def set_state(self, state: HealthState) -> None:
        self._extremes[:] = state.extremes
        self._settle_times = list(state.settle_times)
        self.sample = state.sample
        self._anomalies.set_state(state.anomalies)
        self._settling.set_state(state.settling)

    def snapshot(self) -> Health:
        deepest, deepest_trunk, stretched, twisted = self._extremes.tolist()
        return Health(
            max_penetration_m=deepest,
            max_trunk_penetration_m=deepest_trunk,
            max_weld_error_m=stretched,
            max_weld_error_rad=twisted,
            settle_times=tuple(self._settle_times),
            ejections=self._anomalies.ejections,
            tunnellings=self._anomalies.tunnellings,
            warnings=int(self._rig.data.warning.number.sum()),
        )

    def _scan(self, data: mujoco.MjData, held: Sequence[int | None]) -> bool:
        geoms, distances = _NO_GEOMS, _NO_DISTANCES
        if data.ncon:
            # Kernels are compiled once per memory layout, so make the arrays contiguous.
            geoms, distances = map(np.ascontiguousarray, (data.contact.geom, data.contact.dist))
        found = scan(self._arrays, geoms, distances, held[0] is not None, held[1] is not None)
        if found == WARNED:
            raise PhysicsError(_warning_text(data))
        if found == NOT_FINITE:
            raise PhysicsError(_not_finite_text(self._rig.model, data))
        return bool(found == SUSPECT)


def _warning_text(data: mujoco.MjData) -> str:
    kinds = np.flatnonzero(data.warning.number)
    found = ", ".join(
        f"{mujoco.mjtWarning(int(k)).name} (detail {int(data.warning.lastinfo[k])})" for k in kinds
    )
    return (
        f"MuJoCo warned at t = {data.time:.3f} s: {found}. The state is no longer valid: reset the world, and replay "
        "the recorded actions up to this time to find the cause"
    )


def _not_finite_text(model: mujoco.MjModel, data: mujoco.MjData) -> str:
    bad = np.flatnonzero(~np.isfinite(data.qvel))
    where = model.body(int(model.dof_bodyid[bad[0]])).name if bad.size else "a position"
    return (
        f"the state is not finite at t = {data.time:.3f} s, first at {where!r}: reset the world, and replay the "
        "recorded actions up to this time to find the cause"
    )


QUIET = HealthSample()
