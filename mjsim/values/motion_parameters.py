"""Parameters of a person's motions. They are named tuples, because compiled kernels accept named tuples."""

from typing import Annotated, NamedTuple, get_type_hints


class Range(NamedTuple):
    """The valid range of a parameter. With values in these ranges, every pick or place ends within 30 s."""

    low: float
    high: float


class MotionParameters(NamedTuple):
    """Parameters of the motions with which a person picks and places objects.

    Attributes:
        turn_gain: Yaw rate per heading error while the person turns to an object or receptacle, in 1/s.
        turn_timeout: Maximum duration of such a turn, in seconds.
        object_tolerance: Maximum heading error at which reaching may start, in radians.
        receptacle_tolerance: Maximum heading error at which placing may start, in radians.
        standing_speed: Walking speed below which the person counts as standing still, in m/s.
        standing_turn_rate: Yaw rate below which the person counts as standing still, in rad/s.
        look_gain: Fraction of the pitch error that the head corrects in one control step.
        look_speed: Maximum pitch rate of the head during a motion, in rad/s.
        reach_time: Duration of the movement from the resting posture to the grip, in seconds.
        align_time: Duration of the pause at the grip before the lift, in seconds.
        lift_time: Duration of the movement from the floor to the carrying posture, in seconds.
        lead: Head start of the horizontal or vertical part of a reach or lift, as a fraction of its duration.
        start_time: Time in seconds that a hand needs to start and stop, added to distance divided by speed.
        least_travel: Distance below which a horizontal hand movement is skipped, in metres.
        travel_speed: Speed of a loaded hand above a receptacle, in m/s.
        descent_speed: Speed of a hand that lowers a load, in m/s.
        hover_gap: Gap between a moving load and everything below it, in metres.
        hover_time: Duration of the pause above the slot before the descent, in seconds.
        release_gap: Gap between a load and the surface below it when the hand opens, in metres.
        withdraw_steps: Number of control steps in which the open hand moves straight up.
        withdraw_step: Height by which the hand rises in each of these steps, in metres.
        posture_gain: Speed of a hand that returns to its posture, per remaining distance, in 1/s.
        posture_speed: Speed limit of a hand that returns to its posture, in m/s.
        posture_acceleration: Acceleration limit of a hand that returns to its posture, in m/s^2.
    """

    turn_gain: float = 6.0
    turn_timeout: Annotated[float, Range(0.04, 4.0)] = 3.0
    object_tolerance: float = 0.35
    receptacle_tolerance: float = 0.04
    standing_speed: float = 0.1
    standing_turn_rate: float = 0.5
    look_gain: Annotated[float, Range(0.01, 1.0)] = 0.25
    look_speed: float = 2.0
    reach_time: Annotated[float, Range(0.1, 3.0)] = 0.44
    align_time: Annotated[float, Range(0.0, 2.0)] = 0.12
    lift_time: Annotated[float, Range(0.1, 3.0)] = 0.64
    lead: Annotated[float, Range(0.0, 0.9)] = 0.2
    start_time: Annotated[float, Range(0.0, 1.0)] = 0.12
    least_travel: float = 0.005
    travel_speed: Annotated[float, Range(0.25, 5.0)] = 0.9
    descent_speed: Annotated[float, Range(0.25, 5.0)] = 0.65
    hover_gap: Annotated[float, Range(0.0, 0.3)] = 0.03
    hover_time: Annotated[float, Range(0.0, 2.0)] = 0.08
    release_gap: Annotated[float, Range(0.0, 0.1)] = 0.002
    withdraw_steps: Annotated[int, Range(1, 20)] = 4
    withdraw_step: Annotated[float, Range(0.001, 0.1)] = 0.035
    posture_gain: Annotated[float, Range(1.0, 50.0)] = 7.0
    posture_speed: Annotated[float, Range(0.2, 10.0)] = 1.5
    posture_acceleration: Annotated[float, Range(1.0, 100.0)] = 8.0


class CarryingParameters(NamedTuple):
    """Parameters that keep carried loads clear of the house and of each other.

    Attributes:
        least_height: Minimum height of a load's underside, in metres. It is higher than counters.
        margin: Gap between a load and the house, in metres.
        near: Minimum look-ahead time of the search for free space, in seconds.
        far: Maximum look-ahead time of this search, in seconds.
        most_shift: Maximum sideways shift of a hand before it is pulled towards the body, in metres.
        stacking_gap: Vertical gap between two stacked loads, in metres.
        stacking_distance: Distance over which the right load rises above the approaching left one, in metres.
        push_back: Speed added to the approach speed when a hand yields to a contact of its load, in m/s.
        return_rate: Fraction of a yielding hand's displacement that is undone per second, in 1/s.
        most_compliance: Maximum displacement of a yielding hand, in metres.
    """

    least_height: Annotated[float, Range(0.5, 1.3)] = 0.97
    margin: Annotated[float, Range(0.0, 0.2)] = 0.03
    near: Annotated[float, Range(0.0, 1.0)] = 0.15
    far: Annotated[float, Range(0.0, 1.0)] = 0.3
    most_shift: Annotated[float, Range(0.0, 0.3)] = 0.2
    stacking_gap: Annotated[float, Range(0.0, 0.2)] = 0.04
    stacking_distance: Annotated[float, Range(0.01, 0.5)] = 0.10
    push_back: Annotated[float, Range(0.01, 1.0)] = 0.25
    return_rate: Annotated[float, Range(0.0, 20.0)] = 0.9
    most_compliance: Annotated[float, Range(0.0, 0.3)] = 0.15


class WalkingParameters(NamedTuple):
    """Parameters with which simulated participants walk along a path.

    Attributes:
        look_ahead: Distance to the steering point on the path, in metres. Larger values cut corners, and
            smaller values cause wobbling.
        look_beyond: Length of the path that is checked for obstacles, in metres. It exceeds `sidestep_range`.
        sidestep_range: Distance at which the person starts to sidestep an object on the floor, in metres.
        object_clearance: Distance between the body and the centre of such an object, in metres.
        sidestep_room: Distance to an object, per metre to the side, that is needed to pass it on the far side. It
            prevents repeated changes of side.
        braking_share: Fraction of the acceleration limit that is planned for braking.
        turn_gain: Yaw rate per heading error, in 1/s.
        facing_tolerance: Heading error below which the person counts as facing the goal, in radians.
        least_progress: Distance in metres that a walk has to cover within `PersonParameters.patience`.
            Otherwise, it counts as blocked.
    """

    look_ahead: Annotated[float, Range(0.05, 1.0)] = 0.25
    look_beyond: Annotated[float, Range(0.3, 5.0)] = 1.2
    sidestep_range: Annotated[float, Range(0.1, 3.0)] = 0.8
    object_clearance: Annotated[float, Range(0.05, 0.4)] = 0.20
    sidestep_room: Annotated[float, Range(0.0, 5.0)] = 0.6
    braking_share: Annotated[float, Range(0.1, 1.0)] = 0.5
    turn_gain: Annotated[float, Range(0.5, 20.0)] = 5.0
    facing_tolerance: Annotated[float, Range(0.02, 1.0)] = 0.25
    least_progress: Annotated[float, Range(0.005, 0.5)] = 0.05


# Types of the parameter groups, by their field names in `PersonParameters`.
GROUPS: dict[str, type[MotionParameters] | type[CarryingParameters] | type[WalkingParameters]] = {
    "motion": MotionParameters,
    "carrying": CarryingParameters,
    "walking": WalkingParameters,
}

# Valid ranges that differ from the default of 1e-4 to 10, by group and name, such as `motion.lead`.
GROUP_RANGES: dict[str, Range] = {
    f"{group}.{name}": hint.__metadata__[0]
    for group, kind in GROUPS.items()
    for name, hint in get_type_hints(kind, include_extras=True).items()
    if hasattr(hint, "__metadata__")
}
