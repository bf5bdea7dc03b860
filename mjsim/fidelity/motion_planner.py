"""Picks and places worked out without physics, with the times and speeds of `mjsim.person.motion_parameters`.

Only the fall of what is let go is physics. It decides on success by the same test as placing does.
"""

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.actions import ActionResult, EventKind, Pick
from mjsim.fidelity import motion_primitives
from mjsim.fidelity.body_state import HEADING, LOOK, X, Y
from mjsim.fidelity.fall import drop
from mjsim.fidelity.full import Full
from mjsim.fidelity.kinematic_steps import BODY, HANDS
from mjsim.fidelity.kinematic_world import Walker
from mjsim.fidelity.motion_primitives import Script
from mjsim.model import avatar
from mjsim.model.receptacles import ReceptacleGeometry
from mjsim.person.hand_path import ACROSS_FIRST, STRAIGHT, UP_FIRST
from mjsim.person.placing import hover_height, square_heading
from mjsim.person.slots import Footprint, Slot, best_slot, object_corners

Vector = NDArray[np.float64]

_MOST = 400  # control steps of a motion
_APPROACH = 2  # control steps that a hand lags behind at the end of a reach
_SEATING = 1  # control step in which a load is drawn into a hand that closes firmly
_ANYWHERE = math.nan


@dataclass(frozen=True, eq=False)
class Plan:
    """A motion, worked out.

    Attributes:
        script: The state after each control step.
        length: How many.
        success: Whether the hand holds the object, or it rests in its receptacle.
        incidents: What happens besides: step, kind and object.
    """

    script: Script
    length: int
    success: bool
    incidents: tuple[tuple[int, EventKind, int], ...] = ()


class MotionPlanner:
    """Works out motions from the present state of a walk."""

    def __init__(self, full: Full, walker: Walker) -> None:
        self._full, self._walker = full, walker
        self._tucked, self._aside = np.array(avatar.TUCKED), np.array(avatar.ASIDE)
        self._corners: dict[tuple[int, int], Vector] = {}

    def approach(self, result: ActionResult, hand: int, item: int) -> tuple[Script, int]:
        """Turn to what is picked and reach for it, or turn to its receptacle and bring it over; script and length.

        Data must be in step with the walk, which is left as it was.
        """
        walker = self._walker
        script = Script.empty(_MOST, len(walker.poses))
        before = walker.live.copy(), walker.poses.copy()
        if isinstance(result.action, Pick):
            row, _ = self._reach(script, hand, item)
        else:
            receptacle = self._full.scene.receptacles[str(result.receptacle)]
            row, _, _ = self._bring_over(script, hand, item, receptacle)
        walker.live[:], walker.poses[:] = before
        return script, row

    def pick(self, hand: int, item: int) -> Plan:
        """Take object `item`; data must be in step with the walk, which is left as it was."""
        walker, person, house = self._walker, self._full.person, self._walker.house
        before = walker.live.copy(), walker.poses.copy()
        script = Script.empty(_MOST, len(walker.poses))
        pitch = walker.pitch_target
        row, grip = self._reach(script, hand, item)
        walker.hold(hand, item, grip)
        row = self._wait(script, row, hand, person.steps(person.motion.align_time))
        goal = walker.place_for(hand, item)
        ahead = np.array([math.nan, math.nan, pitch])
        row = self._swing(
            script, row, hand, goal, person.steps(person.motion.lift_time), UP_FIRST, ahead, False
        )
        row = self._wait(script, row, hand, _SEATING)
        row = motion_primitives.end(walker.live, walker.poses, script, row, walker.carry_posture, house)
        walker.live[:], walker.poses[:] = before
        return Plan(script, row, True)

    def place(self, hand: int, item: int, receptacle: ReceptacleGeometry) -> Plan:
        """Put object `item` into its receptacle; data must be in step with the walk, which is left as it was."""
        walker, person = self._walker, self._full.person
        before = walker.live.copy(), walker.poses.copy()
        script = Script.empty(_MOST, len(walker.poses))
        pitch = walker.pitch_target
        row, slot, low = self._bring_over(script, hand, item, receptacle)
        row = self._wait(script, row, hand, person.steps(person.motion.hover_time))
        row = self._descend(
            script,
            row,
            hand,
            receptacle,
            _over(slot.hand, slot.fill + person.motion.release_gap - low),
        )
        fall = drop(self._full, walker, hand, item, receptacle)
        row = motion_primitives.let_go(
            walker.live, walker.poses, script, row, hand, fall.poses, pitch, self._aside, person.motion, walker.house
        )  # fmt: skip
        walker.poses[:] = fall.rest
        released = row - len(fall.poses)
        row = motion_primitives.end(
            walker.live, walker.poses, script, row, walker.carry_posture, walker.house
        )
        walker.live[:], walker.poses[:] = before
        incidents = tuple((released + step, kind, item) for step, kind, item in fall.incidents)
        return Plan(script, row, fall.success, incidents)

    def _reach(self, script: Script, hand: int, item: int) -> tuple[int, int]:
        """Turn to an object and reach for it; the next row, and the grip that is nearest then."""
        person = self._full.person
        center = person.center(item)
        row = self._face(script, center, _ANYWHERE, person.motion.object_tolerance)
        heading = float(self._walker.live[BODY + HEADING])
        grip = person.grips.grip_along(item, np.array([math.cos(heading), math.sin(heading), 0.0]))
        point = person.grips.point(item, grip)
        row = self._swing(
            script, row, hand, point, person.steps(person.motion.reach_time), ACROSS_FIRST, center, True
        )
        return self._wait(script, row, hand, _APPROACH), grip

    def _bring_over(
        self, script: Script, hand: int, item: int, receptacle: ReceptacleGeometry
    ) -> tuple[int, Slot, float]:
        """Turn to a receptacle and bring what is held over it; the next row, the slot, and how far it hangs down, m."""
        person = self._full.person
        tolerance = person.motion.receptacle_tolerance
        row = self._face(script, receptacle.center, square_heading(person, receptacle), tolerance)
        footprint = self._footprint(hand, receptacle)
        low = float(footprint.low[2])
        slot = best_slot(person, item, receptacle, footprint)
        hover = _over(slot.hand, hover_height(person, receptacle, slot) - low)
        return self._travel(script, row, hand, receptacle, hover), slot, low

    def _face(self, script: Script, point: Vector, heading: float, tolerance: float) -> int:
        walker, person = self._walker, self._full.person
        most = person.steps(person.motion.turn_timeout)
        x, y, z = point.tolist()
        return motion_primitives.face(
            walker.live,
            walker.poses,
            script,
            0,
            x,
            y,
            z,
            heading,
            tolerance,
            most,
            self._tucked,
            person.motion,
            walker.house,
        )

    def _swing(
        self, script: Script, row: int, hand: int, goal: Vector, count: int, manner: int, look: Vector, in_house: bool
    ) -> int:  # fmt: skip
        walker = self._walker
        return motion_primitives.swing(
            walker.live, walker.poses, script, row, hand, goal, in_house, count, manner, look, self._aside,
            self._full.person.motion, walker.house,
        )  # fmt: skip

    def _wait(self, script: Script, row: int, hand: int, count: int) -> int:
        live = self._walker.live
        ahead = np.array([math.nan, math.nan, live[BODY + LOOK]])
        return self._swing(script, row, hand, self._hand(hand), count, STRAIGHT, ahead, False)

    def _travel(
        self, script: Script, row: int, hand: int, receptacle: ReceptacleGeometry, hover: Vector
    ) -> int:
        person = self._full.person
        goal = receptacle.center + receptacle.rotation @ hover
        for up_first in (True, False):
            start = self._hand(hand)
            there = self._in_body(goal)
            if up_first:
                there = np.array([start[0], start[1], max(start[2], there[2])])
            distance = float(np.linalg.norm(there - start))
            count = person.travel_steps(distance)
            towards, in_house = (there, False) if up_first else (goal, True)
            row = self._swing(script, row, hand, towards, count, STRAIGHT, receptacle.center, in_house)
        return row

    def _descend(
        self, script: Script, row: int, hand: int, receptacle: ReceptacleGeometry, at: Vector
    ) -> int:
        start, goal = self._hand(hand), self._in_body(receptacle.center + receptacle.rotation @ at)
        count = self._full.person.descent_steps(abs(float(goal[2] - start[2])))
        ahead = np.array([math.nan, math.nan, self._walker.live[BODY + LOOK]])
        row = self._swing(script, row, hand, goal, count, STRAIGHT, ahead, False)
        return self._wait(script, row, hand, 1)  # to see that it touches nothing

    def _hand(self, hand: int) -> Vector:
        return self._walker.live[HANDS + 3 * hand : HANDS + 3 * hand + 3].copy()

    def _in_body(self, point: Vector) -> Vector:
        body = self._walker.live[BODY:HANDS]
        c, s = math.cos(body[HEADING]), math.sin(body[HEADING])
        dx, dy = point[0] - body[X], point[1] - body[Y]
        return np.array([c * dx + s * dy, c * dy - s * dx, point[2]])

    def _footprint(self, hand: int, receptacle: ReceptacleGeometry) -> Footprint:
        """Extent of what a hand holds about it, in the receptacle's axes."""
        hold = self._walker.holds[hand]
        if hold is None:  # a place is only begun with something in the hand
            return Footprint(np.zeros(3), np.zeros(3))
        if hold not in self._corners:
            self._corners[hold] = self._corners_about_hand(*hold)
        heading = float(self._walker.live[BODY + HEADING])
        c, s = math.cos(heading), math.sin(heading)
        turned = self._corners[hold] @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        local = turned @ receptacle.rotation
        return Footprint(low=local.min(axis=0), high=local.max(axis=0))

    def _corners_about_hand(self, item: int, grip: int) -> Vector:
        index, model = self._full.scene.index, self._full.scene.model
        corners = object_corners(model, index.geoms(index.names[item]))
        pose = self._walker.house.grips[item, grip]
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, pose[3:])
        return np.asarray(corners @ rotation.reshape(3, 3).T + pose[:3])


def _over(at: Vector, height: float) -> Vector:
    return np.array([at[0], at[1], height])
