"""How a body moves: picking and placing, carrying, walking. Named tuples, so that kernels can take them."""

from typing import NamedTuple


class MotionParameters(NamedTuple):
    """How the person turns, looks, reaches, lifts, travels with a load, lowers it and withdraws; also for kernels.

    Attributes:
        turn_gain: Yaw rate per heading error while turning to an object or receptacle, 1/s.
        turn_timeout: Longest time that the turn may take, s.
        object_tolerance: Heading error that is good enough for reaching, rad.
        receptacle_tolerance: Heading error that is good enough for placing, rad.
        standing_speed: Slower than this the person stands, m/s.
        standing_turn_rate: Turning slower than this the person stands, rad/s.
        look_gain: Share of a pitch error by which the head moves in one control step.
        look_speed: Fastest pitch of the head during a motion, rad/s.
        reach_time: From the hand's posture to the grip, s.
        align_time: At the grip before the lift, s.
        lift_time: From the floor to the carrying posture, s.
        lead: Share of a reach or lift by which one of its parts (across, up) leads the other.
        start_time: Added to distance over speed for a hand to start and stop, s.
        least_travel: A hand does not travel over less than this, m.
        travel_speed: Speed of a hand that carries a load over a receptacle, m/s.
        descent_speed: Speed of a hand that lowers a load, m/s.
        hover_gap: From a travelling load to whatever it passes over, m.
        hover_time: Above the slot before the descent, s.
        release_gap: From a load to what is below it when the hand opens, m.
        withdraw_steps: Control steps in which the opened hand goes straight up.
        withdraw_step: By how much in each of them, m.
        posture_gain: Speed of a hand on its way to a posture per distance left, 1/s.
        posture_speed: Its fastest, m/s.
        posture_acceleration: How fast that speed changes, m/s^2.
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
    """How the hands carry: how high, and how they keep a load clear of the house and of the other hand's.

    Attributes:
        least_height: Of the underside of what is carried, m: above counters.
        margin: Kept between a load and the house, m.
        near: How far ahead a hand looks for room first, s.
        far: How far ahead it looks at most, s.
        most_shift: Farthest that a hand moves aside before it is drawn in, m.
        stacking_gap: Between two loads one above the other, m.
        stacking_distance: Distance over which the right load rises above the left one as they approach, m.
        push_back: Speed, beyond that of the approach, at which a hand gives way to what its load touches, m/s.
        return_rate: Share of that offset which it takes back in a second, 1/s.
        most_compliance: Farthest that it gives way, m.
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
    """How simulated participants walk along a path.

    Attributes:
        look_ahead: Where on the path the body heads for, m; longer cuts corners into walls, shorter wobbles.
        look_beyond: Where on the path it looks for what is in the way, m; farther than `sidestep_range`.
        sidestep_range: How far ahead an object on the floor is walked around, m.
        object_clearance: Kept between the body and the middle of such an object, m.
        sidestep_room: Room ahead per metre aside for passing on the far side, m/m; with less one would dither.
        braking_share: Share of the acceleration that a person plans to brake with.
        turn_gain: Yaw rate per heading error, 1/s.
        facing_tolerance: Heading error that is good enough at the end of a walk, rad.
        least_progress: A walk that gets on by less within the person's patience is blocked, m.
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


# Groups of a person's values, by name.
GROUPS: dict[str, type[MotionParameters] | type[CarryingParameters] | type[WalkingParameters]] = {
    "motion": MotionParameters,
    "carrying": CarryingParameters,
    "walking": WalkingParameters,
}

# A person of these ranges has picked or placed within 30 s.
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
