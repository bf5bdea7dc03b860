"""The person in the physics simulation, and the basic movements that make up picks and places."""

import math
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.footprint import ClearanceField
from mjsim.house.scene import avatar
from mjsim.house.scene.scene import Scene
from mjsim.house.sight.receptacle_heights import ReceptacleHeights
from mjsim.values.actions import Move
from mjsim.values.motion_parameters import MotionParameters
from mjsim.values.options import WorldOptions
from mjsim.values.person_parameters import PersonParameters
from mjsim.world.body.grips import Grips
from mjsim.world.body.impacts import ImpactDetector
from mjsim.world.body.load_room import carry_clearance
from mjsim.world.body.motion_profiles import change_pitch, change_turn_rate, change_velocity, point_between
from mjsim.world.body.postures import move_hand, posture_pace
from mjsim.world.body.rig import Rig

# A motion is a generator that sets the servos, yields once per control step, and returns True on success.
Motion = Generator[None, None, bool]
Steps = Generator[None, None, None]

DIVISION = 8  # number of parts into which each physics step is divided while an object is fast or strained
MAX_LAG = 0.1  # a held object is stuck if its hand is farther than this from its target, in metres
# Length of a firm grip above which the grip pulls its object in within a few physics steps, in metres
MAX_STRETCH = 0.005


@dataclass(eq=False)
class Person:
    """The person's body in a running physics simulation."""

    scene: Scene
    options: WorldOptions
    data: mujoco.MjData
    rig: Rig
    grips: Grips
    # Indices of the objects in the left and the right hand, None for an empty hand.
    held: list[int | None] = field(default_factory=lambda: [None, None])
    # Velocity of each hand's target while no motion moves the hand, in m/s, shape (2, 3).
    hand_velocities: NDArray[np.float64] = field(default_factory=lambda: np.zeros((2, 3)))
    moving_hand: int | None = None  # index of the hand with a motion, or None
    receptacle_heights: ReceptacleHeights = field(init=False)
    clearance: ClearanceField = field(init=False)  # clearance at the heights of carried objects
    impact_detector: ImpactDetector = field(init=False)
    posture_pace: NDArray[np.float64] = field(init=False)  # see `Hands.pace` in `mjsim.world.body.postures`

    def __post_init__(self) -> None:
        self.receptacle_heights = ReceptacleHeights(self.scene)
        self.clearance = carry_clearance(self.scene)
        self.impact_detector = ImpactDetector(self.scene, self.data, self.clearance, self.dt)
        self.posture_pace = posture_pace(self.motion)

    @property
    def parameters(self) -> PersonParameters:
        return self.scene.person

    @property
    def motion(self) -> MotionParameters:
        return self.scene.person.motion

    @property
    def dt(self) -> float:
        return self.options.control_timestep

    @property
    def carried(self) -> tuple[str, ...]:
        """The instance names of the held objects, from the left to the right hand."""
        return tuple(self.scene.index.names[item] for item in self.held if item is not None)

    @property
    def free_hands(self) -> tuple[int, ...]:
        """The indices of the free hands. A person with a capacity of 1 uses only the right hand."""
        usable = (avatar.LEFT, avatar.RIGHT) if self.options.capacity > 1 else (avatar.RIGHT,)
        return tuple(hand for hand in usable if self.held[hand] is None)

    def advance(self) -> None:
        """Simulate one control step, with shorter physics steps while an object is fast or strained."""
        is_fast = self.impact_detector.detects(self.grips.gripped)
        self.rig.advance(
            DIVISION if is_fast or any(map(self.is_strained, (avatar.LEFT, avatar.RIGHT))) else 1
        )

    def is_strained(self, hand: int) -> bool:
        """Return True if the load of a hand is about to become fast.

        A held object that is stuck at furniture is thrown as soon as it comes free. A grip that has just become firm
        pulls its object away from whatever the object touches.
        """
        if not self.grips.is_firm(hand):
            return False
        lag = math.dist(self.rig.hands[hand], self.rig.hand_targets[hand])
        return lag > MAX_LAG or self.grips.error(hand) > MAX_STRETCH

    def steps(self, seconds: float) -> int:
        """Convert a duration in seconds to a number of control steps, at least 1."""
        return max(1, round(seconds / self.dt))

    def travel_steps(self, distance: float) -> int:
        """Return the number of control steps that a loaded hand needs to move by a distance in metres."""
        motion = self.motion
        if distance < motion.least_travel:
            return 0
        return self.steps(motion.start_time + distance / motion.travel_speed)

    def descent_steps(self, height: float) -> int:
        """Return the number of control steps that a hand needs to lower an object by a height in metres."""
        return self.steps(self.motion.start_time + height / self.motion.descent_speed)

    def move_hand_to_rest(self, hand: int) -> None:
        """Move the target of an empty hand towards its rest posture for one control step."""
        rest = avatar.posture(hand, avatar.REST, self.parameters.eye_height)
        move_hand(self.rig.hand_targets, self.hand_velocities, hand, *rest, self.posture_pace, self.dt)

    def center(self, item: int) -> NDArray[np.float64]:
        """Return an object's centre of mass (3,) in metres."""
        return np.array(self.data.xipos[self.scene.index.bodies[item]])

    def speed(self, item: int) -> float:
        dof = self.scene.index.dofs[item]
        return float(np.linalg.norm(self.data.qvel[dof : dof + 3]))

    def asleep(self, item: int) -> bool:
        return not self.data.tree_awake[self.scene.index.trees[item]]

    def walk(self, move: Move) -> None:
        """Bring the commanded velocities and head pitch closer to those of a move, within the person's limits."""
        command, person, dt = self.rig.motion, self.parameters, self.dt
        forward, left, turn, look = float(move.forward), float(move.left), float(move.turn), float(move.look)
        change_velocity(command, forward, left, person.fastest_walk, person.walking_acceleration * dt)
        change_turn_rate(command, turn, person.turning_speed, person.turning_acceleration * dt)
        change_pitch(command, look, person.looking_speed, *avatar.PITCH_RANGE, dt)

    def brake(self) -> None:
        """Reduce the walking speed for one control step. Turns and head movements are not affected."""
        rig = self.rig
        size = math.hypot(rig.motion[0], rig.motion[1])
        rig.motion[:2] *= (
            max(0.0, size - self.parameters.walking_acceleration * self.dt) / size if size else 0.0
        )

    def turn_towards(self, error: float) -> None:
        """Set the yaw rate so that a heading error in radians decays without overshoot."""
        person, rig = self.parameters, self.rig
        change = _clip(self.motion.turn_gain * error, person.turning_speed) - rig.turn
        rig.motion[2] += _clip(change, person.turning_acceleration * self.dt)

    def glance(self, point: NDArray[np.float64]) -> None:
        """Tilt the head towards a point (3,) in the house for one control step."""
        x, y, z = point.tolist()
        eye_x, eye_y, eye_z = self.rig.eye.tolist()
        self.look_towards(math.atan2(z - eye_z, math.hypot(x - eye_x, y - eye_y)))

    def look_towards(self, pitch: float) -> None:
        """Tilt the head towards a pitch in radians for one control step, at the speed of a glance."""
        target, motion = self.rig.pitch_target, self.motion
        target += _clip(motion.look_gain * (pitch - target), motion.look_speed * self.dt)
        lowest, highest = avatar.PITCH_RANGE
        self.rig.motion[3] = min(highest, max(lowest, target))

    def face(self, point: NDArray[np.float64], tolerance: float, heading: float | None = None) -> Steps:
        """Stop, look at a point (3,), and turn to face it, or to `heading`, until the error is below `tolerance`."""
        motion = self.motion
        for _ in range(self.steps(motion.turn_timeout)):
            error = self.rig.bearing(point) if heading is None else wrap(heading - self.rig.heading)
            standing = (
                self.rig.speed < motion.standing_speed and abs(self.rig.turn_rate) < motion.standing_turn_rate
            )
            if abs(error) < tolerance and standing:
                break
            self.brake()
            self.turn_towards(error if abs(error) > 0.5 * tolerance else 0.0)
            self.glance(point)
            yield
        self.rig.motion[:3] = 0.0

    def swing(
        self, hand: int, goal: Callable[[], NDArray[np.float64]], steps: int, order: int
    ) -> Iterator[None]:
        """Move a hand's target to a goal (3,) that may itself move. Each iteration is one control step."""
        start = self.rig.hand_targets[hand].copy()
        for k in range(1, steps + 1):
            self.rig.hand_targets[hand] = point_between(start, goal(), k / steps, order, self.motion.lead)
            yield


def wrap(angle: float) -> float:
    """Wrap an angle in radians to [-pi, pi)."""
    return (angle + math.pi) % (2 * math.pi) - math.pi


def _clip(value: float, limit: float) -> float:
    return min(limit, max(-limit, value))
