"""A planner for picks and places without physics, which uses the times and speeds of the person.

Only the fall of a released object is simulated by physics. Motions succeed under the same conditions as in
`mjsim.world.body.hand_motions`.
"""

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.sites import ReceptacleGeometry
from mjsim.values.actions import ActionResult, EventKind, Place
from mjsim.world.body.hand_motions import hover_height, square_heading
from mjsim.world.body.load_room import BodyMotion
from mjsim.world.body.motion_profiles import ACROSS_FIRST, STRAIGHT, UP_FIRST
from mjsim.world.body.rig import FORWARD, HEADING, X, Y
from mjsim.world.body.slots import LoadExtent, Slot, best_slot, object_corners
from mjsim.world.fidelity import motion_primitives
from mjsim.world.fidelity.fall import Fall, drop
from mjsim.world.fidelity.full import Full
from mjsim.world.fidelity.kinematic_steps import HANDS
from mjsim.world.fidelity.kinematic_world import KinematicWorld
from mjsim.world.fidelity.motion_primitives import HandMovement, MotionTrajectory

Vector = NDArray[np.float64]

_INITIAL_STEPS = 200  # initial capacity of a trajectory, in control steps
_REACH_LAG = 2  # number of control steps by which the hand lags behind its target at the end of a reach
_SEATING = 1  # number of control steps in which a firm grip pulls the object into the hand


@dataclass(frozen=True, eq=False)
class PlannedMotion:
    """The planned trajectory and outcome of a pick or place."""

    trajectory: MotionTrajectory  # state after each control step
    # True if a picked object is in the hand, or a placed object is at rest in its receptacle.
    success: bool = True
    # Control step, type and object index of other events.
    incidents: tuple[tuple[int, EventKind, int], ...] = ()

    @property
    def length(self) -> int:
        return int(self.trajectory.length[0])


class MotionPlanner:
    """A planner that computes picks and places from the current state of a kinematic world.

    It does not change this state. The physics data must be up to date.
    """

    def __init__(self, full: Full, kinematic: KinematicWorld) -> None:
        self._full, self._kinematic, self._person = full, kinematic, full.person
        self._times, self._steps = full.person.motion, full.person.steps
        self._corners: dict[tuple[int, int], Vector] = {}

    def plan(self, result: ActionResult, hand: int, item: int) -> PlannedMotion:
        state = self._kinematic.state
        before = state.vector.copy(), state.poses.copy()
        self._hand, self._trajectory = hand, MotionTrajectory.empty(_INITIAL_STEPS, len(state.poses))
        if isinstance(result.action, Place):
            planned = self._place(item, self._full.scene.receptacles[str(result.receptacle)])
        else:
            planned = self._pick(item)
        state.vector[:], state.poses[:] = before
        return planned

    def _pick(self, item: int) -> PlannedMotion:
        kinematic, pitch = self._kinematic, self._kinematic.pitch_target
        kinematic.grasp(self._hand, item, self._reach(item))
        self._move(self._hand_position, self._steps(self._times.align_time))
        body_motion = BodyMotion(kinematic.body, kinematic.body[FORWARD:], kinematic.model.clearance)
        goal = self._full.carrying.carry_position(self._hand, item, body_motion)
        order = UP_FIRST if goal[2] > self._hand_position[2] else ACROSS_FIRST
        self._move(goal, self._steps(self._times.lift_time), order, _towards(pitch))
        self._move(self._hand_position, _SEATING)
        self._end()
        return PlannedMotion(self._trajectory)

    def _place(self, item: int, receptacle: ReceptacleGeometry) -> PlannedMotion:
        pitch = self._kinematic.pitch_target
        slot, low = self._bring_over(item, receptacle)
        self._move(self._hand_position, self._steps(self._times.hover_time))
        self._descend(receptacle, _over(slot, slot.fill + self._times.release_gap - low))
        fall = drop(self._full, self._kinematic, self._hand, item, receptacle)
        released = int(self._trajectory.length[0])
        self._withdraw(fall, pitch)
        self._end()
        incidents = tuple((released + step, kind, item) for step, kind, item in fall.incidents)
        return PlannedMotion(self._trajectory, fall.success, incidents)

    def _reach(self, item: int) -> int:
        grips, center = self._person.grips, self._person.center(item)
        self._face(center, math.nan, self._times.object_tolerance)
        heading = float(self._kinematic.body[HEADING])
        grip = grips.grip_along(item, np.array([math.cos(heading), math.sin(heading), 0.0]))
        steps = self._steps(self._times.reach_time)
        self._move(grips.point(item, grip), steps, ACROSS_FIRST, center, in_house=True)
        self._move(self._hand_position, _REACH_LAG)
        return grip

    def _bring_over(self, item: int, receptacle: ReceptacleGeometry) -> tuple[Slot, float]:
        heading = square_heading(self._person, self._hand, receptacle)
        self._face(receptacle.center, heading, self._times.receptacle_tolerance)
        extent = self._load_extent(receptacle)
        low = float(extent.low[2])
        slot = best_slot(self._person, item, receptacle, extent)
        self._travel(receptacle, _over(slot, hover_height(self._person, receptacle, slot) - low))
        return slot, low

    def _load_extent(self, receptacle: ReceptacleGeometry) -> LoadExtent:
        grasp = self._kinematic.grasps[self._hand]
        if grasp is None:  # A place always starts with a loaded hand. Only the type checker needs this line.
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

    @property
    def _hand_position(self) -> Vector:
        first = HANDS + 3 * self._hand
        return self._kinematic.state.vector[first : first + 3].copy()

    def _face(self, point: Vector, heading: float, tolerance: float) -> None:
        kinematic, steps = self._kinematic, self._steps(self._times.turn_timeout)
        room = self._room(steps)
        motion_primitives.face(
            kinematic.state, room, point, heading, tolerance, steps, self._times, kinematic.model
        )

    def _move(
        self,
        goal: Vector,
        steps: int,
        order: int = STRAIGHT,
        gaze: Vector | None = None,
        *,
        in_house: bool = False,
    ) -> None:
        kinematic, room = self._kinematic, self._room(steps)
        gaze = _towards(kinematic.pitch_target) if gaze is None else gaze
        movement = HandMovement(self._hand, goal, in_house, steps, order, gaze)
        motion_primitives.move_hand(kinematic.state, room, movement, self._times, kinematic.model)

    def _travel(self, receptacle: ReceptacleGeometry, hover: Vector) -> None:
        goal, person = receptacle.center + receptacle.rotation @ hover, self._person
        start, above = self._hand_position, self._in_body(goal)
        before = np.array([start[0], above[1], max(start[2], above[2])])
        steps = person.travel_steps(float(np.linalg.norm(before - start)))
        self._move(before, steps, UP_FIRST, receptacle.center)
        distance = float(np.linalg.norm(self._in_body(goal) - self._hand_position))
        self._move(goal, person.travel_steps(distance), gaze=receptacle.center, in_house=True)

    def _descend(self, receptacle: ReceptacleGeometry, release: Vector) -> None:
        goal = self._in_body(receptacle.center + receptacle.rotation @ release)
        self._move(goal, self._person.descent_steps(abs(float(goal[2] - self._hand_position[2]))))
        self._move(self._hand_position, 1)

    def _withdraw(self, fall: Fall, pitch: float) -> None:
        kinematic, room = self._kinematic, self._room(len(fall.poses))
        motion_primitives.withdraw(
            kinematic.state, room, self._hand, fall.poses, pitch, self._times, kinematic.model
        )
        kinematic.state.poses[:] = fall.rest

    def _end(self) -> None:
        motion_primitives.end(self._kinematic.state, self._room(1), self._kinematic.model)

    def _room(self, steps: int) -> MotionTrajectory:
        if int(self._trajectory.length[0]) + steps > len(self._trajectory.vectors):
            self._trajectory = self._trajectory.longer(steps)
        return self._trajectory

    def _in_body(self, point: Vector) -> Vector:
        body = self._kinematic.body
        c, s = math.cos(body[HEADING]), math.sin(body[HEADING])
        dx, dy = point[0] - body[X], point[1] - body[Y]
        return np.array([c * dx + s * dy, c * dy - s * dx, point[2]])


def _over(slot: Slot, height: float) -> Vector:
    return np.array([slot.hand[0], slot.hand[1], height])


def _towards(pitch: float) -> Vector:
    return np.array([math.nan, math.nan, pitch])
