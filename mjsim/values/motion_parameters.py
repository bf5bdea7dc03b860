"""Parameters of a person's motions, as named tuples because kernels accept those."""

from typing import NamedTuple


class MotionParameters(NamedTuple):
    """Parameters of picking and placing: turning, looking, reaching, lifting, lowering and withdrawing.

    Attributes:
        turn_gain: Yaw rate per heading error while turning to an object or receptacle, 1/s.
        turn_timeout: Longest time for that turn, s.
        object_tolerance: Heading error at which reaching may start, rad.
        receptacle_tolerance: Heading error at which placing may start, rad.
        standing_speed: A slower person counts as standing, m/s.
        standing_turn_rate: A person who turns more slowly counts as standing, rad/s.
        look_gain: Share of the pitch error that the head corrects in one control step.
        look_speed: Fastest pitch rate of the head during a motion, rad/s.
        reach_time: Time from the hand's posture to the grip, s.
        align_time: Pause at the grip before the lift, s.
        lift_time: Time from the floor to the carrying posture, s.
        lead: Head start of the horizontal or the vertical part of a reach or lift, as a share of its time.
        start_time: Time for a hand to start and stop, added to distance over speed, s.
        least_travel: Shorter horizontal hand movements are skipped, m.
        travel_speed: Speed of a loaded hand above a receptacle, m/s.
        descent_speed: Speed of a hand that lowers a load, m/s.
        hover_gap: Gap between a moving load and everything below it, m.
        hover_time: Pause above the slot before the descent, s.
        release_gap: Gap between a load and what is below it when the hand opens, m.
        withdraw_steps: Number of control steps in which the open hand moves straight up.
        withdraw_step: Distance per such step, m.
        posture_gain: Speed of a hand that returns to a posture, per remaining distance, 1/s.
        posture_speed: Upper limit of that speed, m/s.
        posture_acceleration: Acceleration limit of that speed, m/s^2.
    """

    turn_gain: float = 6.0
    turn_timeout: float = 3.0
    object_tolerance: float = 0.35
    receptacle_tolerance: float = 0.04
    standing_speed: float = 0.1
    standing_turn_rate: float = 0.5
    look_gain: float = 0.25
    look_speed: float = 2.0
    reach_time: float = 0.44
    align_time: float = 0.12
    lift_time: float = 0.64
    lead: float = 0.2
    start_time: float = 0.12
    least_travel: float = 0.005
    travel_speed: float = 0.9
    descent_speed: float = 0.65
    hover_gap: float = 0.03
    hover_time: float = 0.08
    release_gap: float = 0.002
    withdraw_steps: int = 4
    withdraw_step: float = 0.035
    posture_gain: float = 7.0
    posture_speed: float = 1.5
    posture_acceleration: float = 8.0


class CarryingParameters(NamedTuple):
    """Parameters of carrying: the height of loads, and how they avoid the house and each other.

    Attributes:
        least_height: Lowest height of a load's underside, above counters, m.
        margin: Gap between a load and the house, m.
        near: Shortest time that a hand looks ahead for free space, s.
        far: Longest time that it looks ahead, s.
        most_shift: Farthest that a hand moves sideways before it is drawn in, m.
        stacking_gap: Gap between two loads, one above the other, m.
        stacking_distance: Distance over which the right load rises above the left one as they approach, m.
        push_back: Speed at which a hand yields to what its load touches, in addition to that of the approach, m/s.
        return_rate: Share of that displacement that is undone per second, 1/s.
        most_compliance: Largest such displacement, m.
    """

    least_height: float = 0.97
    margin: float = 0.03
    near: float = 0.15
    far: float = 0.3
    most_shift: float = 0.2
    stacking_gap: float = 0.04
    stacking_distance: float = 0.10
    push_back: float = 0.25
    return_rate: float = 0.9
    most_compliance: float = 0.15


class WalkingParameters(NamedTuple):
    """Parameters of simulated participants who walk along a path.

    Attributes:
        look_ahead: Distance along the path of the point to walk to, m. More cuts corners, less wobbles.
        look_beyond: Distance along the path that is searched for obstacles, m. It exceeds `sidestep_range`.
        sidestep_range: Distance at which the person starts to walk around an object on the floor, m.
        object_clearance: Gap between the body and the middle of such an object, m.
        sidestep_room: Distance ahead per sideways distance that is needed to pass on the far side, m/m. It prevents
            changing sides back and forth.
        braking_share: Share of the acceleration limit that is planned for braking.
        turn_gain: Yaw rate per heading error, 1/s.
        facing_tolerance: Heading error at which the person faces the goal, rad.
        least_progress: A walk that progresses less than this within `PersonParameters.patience` is blocked, m.
    """

    look_ahead: float = 0.25
    look_beyond: float = 1.2
    sidestep_range: float = 0.8
    object_clearance: float = 0.20
    sidestep_room: float = 0.6
    braking_share: float = 0.5
    turn_gain: float = 5.0
    facing_tolerance: float = 0.25
    least_progress: float = 0.05


# Field of `PersonParameters` -> its type.
GROUPS: dict[str, type[MotionParameters] | type[CarryingParameters] | type[WalkingParameters]] = {
    "motion": MotionParameters,
    "carrying": CarryingParameters,
    "walking": WalkingParameters,
}

# Ranges in which a pick or place ends within 30 s.
GROUP_RANGES: dict[str, tuple[float, float]] = {
    "motion.turn_timeout": (0.04, 4.0),
    "motion.look_gain": (0.01, 1.0),
    "motion.reach_time": (0.1, 3.0),
    "motion.align_time": (0.0, 2.0),
    "motion.lift_time": (0.1, 3.0),
    "motion.lead": (0.0, 0.9),
    "motion.start_time": (0.0, 1.0),
    "motion.travel_speed": (0.25, 5.0),
    "motion.descent_speed": (0.25, 5.0),
    "motion.hover_gap": (0.0, 0.3),
    "motion.hover_time": (0.0, 2.0),
    "motion.release_gap": (0.0, 0.1),
    "motion.withdraw_steps": (1, 20),
    "motion.withdraw_step": (0.001, 0.1),
    "motion.posture_gain": (1.0, 50.0),
    "motion.posture_speed": (0.2, 10.0),
    "motion.posture_acceleration": (1.0, 100.0),
    "carrying.least_height": (0.5, 1.3),
    "carrying.margin": (0.0, 0.2),
    "carrying.near": (0.0, 1.0),
    "carrying.far": (0.0, 1.0),
    "carrying.most_shift": (0.0, 0.3),
    "carrying.stacking_gap": (0.0, 0.2),
    "carrying.stacking_distance": (0.01, 0.5),
    "carrying.push_back": (0.01, 1.0),
    "carrying.return_rate": (0.0, 20.0),
    "carrying.most_compliance": (0.0, 0.3),
    "walking.look_ahead": (0.05, 1.0),
    "walking.look_beyond": (0.3, 5.0),
    "walking.sidestep_range": (0.1, 3.0),
    "walking.object_clearance": (0.05, 0.4),
    "walking.sidestep_room": (0.0, 5.0),
    "walking.braking_share": (0.1, 1.0),
    "walking.turn_gain": (0.5, 20.0),
    "walking.facing_tolerance": (0.02, 1.0),
    "walking.least_progress": (0.005, 0.5),
}
