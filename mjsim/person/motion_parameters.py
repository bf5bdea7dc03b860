"""Times, speeds, distances and gains of picking and placing: one set of numbers for every tier of fidelity."""

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


MOTION = MotionParameters()
