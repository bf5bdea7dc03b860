"""Picks and places worked out without physics, with the times and speeds of `mjsim.person_parameters`.

Only the fall of a released object is physics. Success is decided by the same test as in `mjsim.person.placing`.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.actions import ActionResult, EventKind, Pick
from mjsim.fidelity import motion_primitives
from mjsim.fidelity.body_state import FORWARD, HEADING, X, Y
from mjsim.fidelity.fall import Fall, drop
from mjsim.fidelity.full import Full
from mjsim.fidelity.kinematic_steps import HANDS
from mjsim.fidelity.kinematic_world import KinematicWorld
from mjsim.fidelity.motion_primitives import HandMovement, MotionTrajectory
from mjsim.model.receptacles import ReceptacleGeometry
from mjsim.person.hand_path import ACROSS_FIRST, STRAIGHT, UP_FIRST
from mjsim.person.load_room import BodyMotion
from mjsim.person.placing import hover_height, square_heading
from mjsim.person.slots import LoadExtent, Slot, best_slot, object_corners

Vector = NDArray[np.float64]

_USUAL_STEPS = 200  # control steps of a motion; room for more is made when it is needed
_REACH_LAG = 2  # control steps that a hand lags behind at the end of a reach
_SEATING = 1  # control step in which a load is drawn into a hand that closes firmly


@dataclass(frozen=True, eq=False)
class PlannedMotion:
    """A pick or place, or the part of it before physics begins, worked out.

    Attributes:
        trajectory: The state after each control step.
        success: Whether the hand holds the object, or it rests in its receptacle.
        incidents: Other events: control step, kind and object.
    """

    trajectory: MotionTrajectory
    success: bool = True
    incidents: tuple[tuple[int, EventKind, int], ...] = ()

    @property
    def length(self) -> int:
        """Number of control steps."""
        return int(self.trajectory.length[0])


class MotionPlanner:
    """Works out motions from the present state of a kinematic world, which is left as it was.

    The data of the physics must be in step with it.
    """

    def __init__(self, full: Full, kinematic: KinematicWorld) -> None:
        self._full, self._kinematic = full, kinematic
        self._corners: dict[tuple[int, int], Vector] = {}

    def approach(self, result: ActionResult, hand: int, item: int) -> PlannedMotion:
        """Turn to an object and reach for it, or turn to its receptacle and bring it over."""
        with self._motion(hand) as motion:
            if isinstance(result.action, Pick):
                self._reach(motion, item)
            else:
                self._bring_over(motion, item, self._receptacle(result))
        return PlannedMotion(motion.trajectory)

    def plan(self, result: ActionResult, hand: int, item: int) -> PlannedMotion:
        """The whole pick or place."""
        with self._motion(hand) as motion:
            if isinstance(result.action, Pick):
                self._pick(motion, item)
                planned = PlannedMotion(motion.trajectory)
            else:
                planned = self._place(motion, item, self._receptacle(result))
        return planned

    def _receptacle(self, result: ActionResult) -> ReceptacleGeometry:
        return self._full.scene.receptacles[str(result.receptacle)]

    @contextmanager
    def _motion(self, hand: int) -> "Iterator[_Motion]":
        """Work out a motion from the present state, which comes back afterwards."""
        state = self._kinematic.state
        before = state.vector.copy(), state.poses.copy()
        yield _Motion(self._full, self._kinematic, hand)
        state.vector[:], state.poses[:] = before

    def _pick(self, motion: "_Motion", item: int) -> None:
        times = self._full.person.motion
        pitch = self._kinematic.pitch_target
        grip = self._reach(motion, item)
        self._kinematic.grasp(motion.hand, item, grip)
        motion.wait(times.align_time)
        body = self._kinematic.body
        body_motion = BodyMotion(body, body[FORWARD:], self._kinematic.model.clearance)
        goal = self._full.carrying.carry_position(motion.hand, item, body_motion)
        motion.move(goal, motion.steps(times.lift_time), UP_FIRST, _towards(pitch))
        motion.move(motion.hand_position, _SEATING)
        motion.end()

    def _place(self, motion: "_Motion", item: int, receptacle: ReceptacleGeometry) -> PlannedMotion:
        times = self._full.person.motion
        pitch = self._kinematic.pitch_target
        slot, low = self._bring_over(motion, item, receptacle)
        motion.wait(times.hover_time)
        motion.descend(receptacle, _over(slot, slot.fill + times.release_gap - low))
        fall = drop(self._full, self._kinematic, motion.hand, item, receptacle)
        released = motion.length
        motion.withdraw(fall, pitch)
        motion.end()
        incidents = tuple((released + step, kind, item) for step, kind, item in fall.incidents)
        return PlannedMotion(motion.trajectory, fall.success, incidents)

    def _reach(self, motion: "_Motion", item: int) -> int:
        """Turn to an object and reach for it; the grip that is nearest then."""
        person = self._full.person
        center = person.center(item)
        motion.face(center, math.nan, person.motion.object_tolerance)
        heading = float(self._kinematic.body[HEADING])
        grip = person.grips.grip_along(item, np.array([math.cos(heading), math.sin(heading), 0.0]))
        point, steps = person.grips.point(item, grip), motion.steps(person.motion.reach_time)
        motion.move(point, steps, ACROSS_FIRST, center, in_house=True)
        motion.move(motion.hand_position, _REACH_LAG)
        return grip

    def _bring_over(self, motion: "_Motion", item: int, receptacle: ReceptacleGeometry) -> tuple[Slot, float]:
        """Turn to a receptacle and bring the load over it; the slot, and how far below the hand the load ends, m."""
        person = self._full.person
        heading = square_heading(person, receptacle)
        motion.face(receptacle.center, heading, person.motion.receptacle_tolerance)
        extent = self._load_extent(motion.hand, receptacle)
        low = float(extent.low[2])
        slot = best_slot(person, item, receptacle, extent)
        motion.travel(receptacle, _over(slot, hover_height(person, receptacle, slot) - low))
        return slot, low

    def _load_extent(self, hand: int, receptacle: ReceptacleGeometry) -> LoadExtent:
        """Extent of a load about the hand that holds it, in the receptacle's axes."""
        grasp = self._kinematic.grasps[hand]
        if grasp is None:  # a place begins only with something in the hand
            return LoadExtent(np.zeros(3), np.zeros(3))
        if grasp not in self._corners:
            self._corners[grasp] = self._corners_about_hand(*grasp)
        heading = float(self._kinematic.body[HEADING])
        c, s = math.cos(heading), math.sin(heading)
        turned = self._corners[grasp] @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        local = turned @ receptacle.rotation
        return LoadExtent(low=local.min(axis=0), high=local.max(axis=0))

    def _corners_about_hand(self, item: int, grip: int) -> Vector:
        index, model = self._full.scene.index, self._full.scene.model
        corners = object_corners(model, index.geoms(index.names[item]))
        pose = self._kinematic.model.grips[item, grip]
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, pose[3:])
        return np.asarray(corners @ rotation.reshape(3, 3).T + pose[:3])


class _Motion:
    """A motion being worked out: each movement appends its control steps to the trajectory.

    Attributes:
        hand: Hand that picks or places.
        trajectory: The control steps so far.
    """

    def __init__(self, full: Full, kinematic: KinematicWorld, hand: int) -> None:
        self._person, self._kinematic, self.hand = full.person, kinematic, hand
        self.trajectory = MotionTrajectory.empty(_USUAL_STEPS, len(kinematic.state.poses))
        self.steps = full.person.steps

    @property
    def length(self) -> int:
        """Control steps so far."""
        return int(self.trajectory.length[0])

    @property
    def hand_position(self) -> Vector:
        """The hand in the body frame, m, shape (3,)."""
        first = HANDS + 3 * self.hand
        return self._kinematic.state.vector[first : first + 3].copy()

    def face(self, point: Vector, heading: float, tolerance: float) -> None:
        """Stand still and turn to a point (3,) m, or to a heading unless that is NaN, rad."""
        motion, kinematic = self._person.motion, self._kinematic
        steps = self.steps(motion.turn_timeout)
        self._make_room(steps)
        motion_primitives.face(
            kinematic.state, self.trajectory, point, heading, tolerance, steps, motion, kinematic.model
        )

    def move(
        self,
        goal: Vector,
        steps: int,
        order: int = STRAIGHT,
        gaze: Vector | None = None,
        *,
        in_house: bool = False,
    ) -> None:
        """Move the hand to a goal (3,) m; see `HandMovement`. Without a gaze the head stays as it is."""
        kinematic = self._kinematic
        gaze = _towards(kinematic.pitch_target) if gaze is None else gaze
        self._make_room(steps)
        movement = HandMovement(self.hand, goal, in_house, steps, order, gaze)
        motion_primitives.move_hand(
            kinematic.state, self.trajectory, movement, self._person.motion, kinematic.model
        )

    def wait(self, seconds: float) -> None:
        """Keep the hand where it is."""
        self.move(self.hand_position, self.steps(seconds))

    def travel(self, receptacle: ReceptacleGeometry, hover: Vector) -> None:
        """Up to the hover height, then across to the hover position (3,) in the receptacle's axes, m."""
        goal, person = receptacle.center + receptacle.rotation @ hover, self._person
        start, above = self.hand_position, self._in_body(goal)
        up = np.array([start[0], start[1], max(start[2], above[2])])
        self.move(up, person.travel_steps(float(np.linalg.norm(up - start))), gaze=receptacle.center)
        distance = float(np.linalg.norm(self._in_body(goal) - self.hand_position))
        self.move(goal, person.travel_steps(distance), gaze=receptacle.center, in_house=True)

    def descend(self, receptacle: ReceptacleGeometry, release: Vector) -> None:
        """Down to the release position (3,) in the receptacle's axes, m, and one step more to see what it touches."""
        goal = self._in_body(receptacle.center + receptacle.rotation @ release)
        steps = self._person.descent_steps(abs(float(goal[2] - self.hand_position[2])))
        self.move(goal, steps)
        self.move(self.hand_position, 1)

    def withdraw(self, fall: Fall, pitch: float) -> None:
        """Withdraw the hand while the released object falls; the head looks to `pitch`, rad."""
        kinematic = self._kinematic
        self._make_room(len(fall.poses))
        motion_primitives.withdraw(
            kinematic.state,
            self.trajectory,
            self.hand,
            fall.poses,
            pitch,
            self._person.motion,
            kinematic.model,
        )
        kinematic.state.poses[:] = fall.rest

    def end(self) -> None:
        """The control step in which the motion has ended."""
        self._make_room(1)
        motion_primitives.end(self._kinematic.state, self.trajectory, self._kinematic.model)

    def _make_room(self, steps: int) -> None:
        if self.length + steps > len(self.trajectory.vectors):
            self.trajectory = self.trajectory.longer(steps)

    def _in_body(self, point: Vector) -> Vector:
        body = self._kinematic.body
        c, s = math.cos(body[HEADING]), math.sin(body[HEADING])
        dx, dy = point[0] - body[X], point[1] - body[Y]
        return np.array([c * dx + s * dy, c * dy - s * dx, point[2]])


def _over(slot: Slot, height: float) -> Vector:
    return np.array([slot.hand[0], slot.hand[1], height])


def _towards(pitch: float) -> Vector:
    """The gaze of a `HandMovement` that only looks to a pitch, rad."""
    return np.array([math.nan, math.nan, pitch])
