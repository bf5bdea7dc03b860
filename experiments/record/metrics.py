"""Compute the objective measures of a trial from its event log and trajectory (PAPER section 6)."""

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.record.columns import HEALTH
from experiments.record.phases import FLYTHROUGH, is_simulated
from experiments.record.records import PARTICIPANT, PHASE_ENDED, Event
from mjsim.values.actions import EventKind
from mjsim.values.motion_parameters import GROUPS

REGRETFUL_M = 0.01  # smallest regret that does not count as a tie
COSTLY_M = 0.1  # regret above which `nd_regret_10cm` counts a deviation
# Fields of the start event that are not settings of the trial
PROVENANCE = {"t", "event", "format", "versions", "model", "world", "inputs", "episode_sha256", "order"}
PROVENANCE |= {"person", "behaviour"}
# Fields of `metrics.json` that cannot be recomputed. Only the checksum of the file protects them.
CIRCUMSTANCES = ("frames_sha256", "renderer", "wall_s")
# The type of event that each metric counts
COUNTED = {
    "ejections": EventKind.EJECTED,
    "tunnellings": EventKind.TUNNELLED,
    "grips_lost": EventKind.GRIP_LOST,
}


@dataclass(frozen=True)
class Metrics:
    """The objective measures of a trial, which are defined in docs/metrics.md.

    Attributes:
        ended: Reason why the trial ended.
        delivered: Number of objects in their receptacle at the end.
        visits: Number of successful picks and places.
        nd_strict_2n: Visits that differ from the suggested one, divided by twice the number of objects. Like
            the other deviations and inverse path lengths, it is None if no visit was made.
        nd_feasible: Visits that differ from the suggested one, divided by the number of visits with a
            feasible alternative. It is 0 if there was never a choice.
        nd_bin_tied: As `nd_feasible`, but the order in which objects go into the same bin is ignored.
        nd_regret_10cm: Number of deviations with a regret above 0.1 m, divided by the number of visits with a
            known regret; None if no regret is known.
        ipl_locations: The paper's inverse path length, which can exceed 1. It is the total distance between
            the locations (objects and bins) of consecutive visits, divided by the distance walked.
        ipl_stand: Shortest walks between the positions at consecutive visits, divided by the distance walked.
        task_distance_m: Distance walked in metres.
        completion_time_s: Time in seconds until the last delivery, or until the end if objects are left.
        completion_over_familiarisation: Completion time divided by the duration of the fly-through; None if
            there was no fly-through.
        planned_distance_m: Length of the first plan in metres, from location to location. Reaching for objects makes
            the walk shorter.
        reach_bound_m: Lower bound in metres on the walking distance at maximum reach; None if nothing was planned.
        replans: Number of plans that replaced the previous one because the task no longer matched it.
        refusals: Number of infeasible attempts.
        failures: Number of picks and places that started but failed in the physics, and of objects lost from a hand.
        mean_regret_m: Mean regret of the visits in metres. The regret of a visit is the extra length of the remaining
            task compared with the best visit at that moment; None if no regret is known.
        total_regret_m: Sum of these regrets in metres, which is the extra walk caused by the order of visits; None if
            no regret is known.
        regretful_visits: Visits with a regret above 1 cm; None if no regret is known. The others are optimal or tied.
        unjudged_visits: Visits whose regret is unknown because it was not computed or could not be proved.
        mean_suggestion_gap_m: Mean regret of the suggested visits in metres; None if none is known. It measures the
            planner as `mean_regret_m` measures the person.
        max_suggestion_gap_m: Largest regret of a suggested visit in metres; None if none is known.
    """

    ended: str | None
    delivered: int
    visits: int
    nd_strict_2n: float | None
    nd_feasible: float | None
    nd_bin_tied: float | None
    nd_regret_10cm: float | None
    ipl_locations: float | None
    ipl_stand: float | None
    task_distance_m: float
    completion_time_s: float
    completion_over_familiarisation: float | None
    planned_distance_m: float | None
    reach_bound_m: float | None
    replans: int
    refusals: int
    failures: int
    mean_regret_m: float | None
    total_regret_m: float | None
    regretful_visits: int | None
    unjudged_visits: int
    mean_suggestion_gap_m: float | None
    max_suggestion_gap_m: float | None


def measure(events: Sequence[Event], arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """Return the part of `metrics.json` that can be computed from the event log and the trajectory.

    Args:
        events: The event log in order, from `start` to `end`.
        arrays: The trajectory, with the columns in `TRAJECTORY_COLUMNS` and at least one row.
    """
    settings = {name: value for name, value in events[0].items() if name not in PROVENANCE}
    ending = {name: events[-1][name] for name in ("signal", "error") if name in events[-1]}
    return {
        **settings,
        "simulated": is_simulated(settings.get("user")),
        **_person(events),
        **asdict(compute_metrics(events, arrays["position"])),
        **summarise_health(events, arrays),
        **displays(events),
        "simulated_s": float(arrays["time"][-1]),
        **ending,
    }


def compute_metrics(events: Sequence[Event], positions: NDArray[np.float64]) -> Metrics:
    """Compute the metrics of a trial.

    Args:
        events: The event log in order. If the last delivery ended the trial, `end` has the same time.
        positions: Floor position in metres at every control step, shape (T, 2).
    """
    visits = [e for e in events if e["event"] == "visit"]
    plans = [e for e in events if e["event"] == "plan"]
    walked = float(np.linalg.norm(np.diff(positions, axis=0), axis=1).sum()) if len(positions) > 1 else 0.0
    regrets, gaps = _regrets(events, visits, "regret_m"), _regrets(events, visits, "suggested_regret_m")
    known = list(regrets.values())
    end = float(events[-1]["t"])
    return Metrics(
        ended=events[-1].get("reason"),
        delivered=_count(events, "placed") - _count(events, "dislodged"),
        visits=len(visits),
        nd_strict_2n=_over(_deviations(visits), 2 * events[0]["objects"]) if visits else None,
        nd_feasible=_over(_deviations(_choices(visits)), len(_choices(visits))) if visits else None,
        nd_bin_tied=_nd_bin_tied(visits) if visits else None,
        nd_regret_10cm=_nd_regret(visits, regrets),
        ipl_locations=_path_length(visits, "location_m", walked),
        ipl_stand=_path_length(visits, "geodesic_m", walked),
        task_distance_m=walked,
        completion_time_s=end,
        completion_over_familiarisation=_over_familiarisation(events, end),
        planned_distance_m=float(plans[0]["cost_m"]) if plans else None,
        reach_bound_m=float(plans[0]["reach_bound_m"]) if plans else None,
        replans=max(sum(not p.get("improved", False) for p in plans) - 1, 0),
        refusals=sum(e["event"] == "attempt" and not e["applied"] for e in events),
        failures=_count(events, "pick_failed", "place_failed", "grip_lost"),
        mean_regret_m=sum(known) / len(known) if known else None,
        total_regret_m=sum(known) if known else None,
        regretful_visits=sum(regret > REGRETFUL_M for regret in known) if known else None,
        unjudged_visits=len(visits) - len(known),
        mean_suggestion_gap_m=sum(gaps.values()) / len(gaps) if gaps else None,
        max_suggestion_gap_m=max(gaps.values(), default=None),
    )


def _person(events: Sequence[Event]) -> dict[str, Any]:
    logged: Mapping[str, Any] = next((e for e in events if e["event"] == PARTICIPANT), {"person": {}})
    body = {f"person_{name}": value for name, value in logged["person"].items() if name not in GROUPS}
    model = logged.get("behaviour") or {}
    return body | {f"behaviour_{name.replace('.', '_')}": value for name, value in model.items()}


def _count(events: Sequence[Event], *kinds: str) -> int:
    return sum(event["event"] in kinds for event in events)


def _over(part: float, whole: float, empty: float = 0.0) -> float:
    return part / whole if whole > 0 else empty


def _path_length(visits: Sequence[Event], between: str, walked: float) -> float | None:
    return _over(sum(visit[between] for visit in visits), walked, empty=1.0) if visits else None


def _choices(visits: Sequence[Event]) -> list[Event]:
    return [visit for visit in visits if visit["alternatives"] > 0]


def _deviations(visits: Sequence[Event]) -> int:
    return sum(visit["deviated"] for visit in visits)


def _nd_bin_tied(visits: Sequence[Event]) -> float:
    choices = [visit for visit in visits if visit["alternatives"] > visit["tied_alternatives"]]
    return _over(sum(v["deviated"] and not v["tied"] for v in choices), len(choices))


def _nd_regret(visits: Sequence[Event], regrets: Mapping[int, float]) -> float | None:
    judged = [(v, regrets[k]) for k, v in enumerate(visits) if v["alternatives"] > 0 and k in regrets]
    if not regrets:
        return None
    return _over(sum(v["deviated"] and regret > COSTLY_M for v, regret in judged), len(judged))


def _over_familiarisation(events: Sequence[Event], completion: float) -> float | None:
    ended = [e for e in events if e["event"] == PHASE_ENDED and e["phase"] == FLYTHROUGH]
    watched = sum(float(event["duration_s"]) for event in ended)
    return completion / watched if watched > 0 else None


def _regrets(events: Sequence[Event], visits: Sequence[Event], name: str) -> dict[int, float]:
    found = {k: visit.get(name) for k, visit in enumerate(visits)}
    found |= {e["visit"]: e[name] for e in events if e["event"] == "regret" and name in e}
    return {k: float(regret) for k, regret in found.items() if regret is not None}


def summarise_health(events: Sequence[Event], arrays: Mapping[str, NDArray[Any]]) -> dict[str, float | int]:
    """Summarize the errors of the physics simulation in a trial (docs/metrics.md).

    Weld errors are sampled while a hand carries an object, settling times once per release, and penetration
    at every control step. A value without samples is 0.

    Args:
        events: The event log.
        arrays: The trajectory, with the columns in `TRAJECTORY_COLUMNS`.

    Returns:
        The maximum, the 99th percentile and the mean of each quantity, and the number of faults, by name.
    """
    summary: dict[str, float | int] = {}
    for name in HEALTH:
        values = arrays[name][~np.isnan(arrays[name])]
        for label, value in (
            ("max", values.max(initial=0.0)),
            ("p99", np.percentile(values, 99) if values.size else 0.0),
            ("mean", values.mean() if values.size else 0.0),
        ):
            summary[f"{label}_{name}"] = float(value)
    summary["releases_settled"] = int(np.count_nonzero(~np.isnan(arrays["settle_s"])))
    for name, kind in COUNTED.items():
        summary[name] = sum(event["event"] == kind.value for event in events)
    return summary


@dataclass(frozen=True)
class Displays:
    """The display quality of a trial, as medians over its `display` events, which are logged every 5 s.

    Attributes:
        drawn_by_browser: Share of events in which the browser, and not the server, drew the view.
        display_renderer: Most frequent renderer.
        display_width: Width of the view in CSS pixels.
        display_height: Height of the view in CSS pixels.
        display_pixel_ratio: Screen pixels per CSS pixel.
        display_frames_per_s: Frames shown per second. If the server draws, periods without changes do not count.
        display_frame_ms_95: 95th percentile of the time between two frames in milliseconds.
        display_latency_ms: Time in milliseconds from an input to the frame that shows it; None if nothing was pressed.
        display_dropped: Share of the received frames that were not shown.
        display_field_of_view: Horizontal field of view in radians; None if the person could not choose it.
    """

    drawn_by_browser: float
    display_renderer: str
    display_width: float
    display_height: float
    display_pixel_ratio: float
    display_frames_per_s: float
    display_frame_ms_95: float
    display_latency_ms: float | None
    display_dropped: float
    display_field_of_view: float | None


def displays(events: Sequence[Event]) -> dict[str, Any]:
    """Return the display quality of a trial, or an empty dictionary if it was not logged."""
    reports = [event for event in events if event["event"] == "display"]
    if not reports:
        return {}

    def median(name: str) -> float:
        return float(statistics.median(event[name] for event in reports))

    shown = sum(5.0 * event["frames_per_s"] for event in reports)
    dropped = sum(event["dropped"] for event in reports)
    waits = [event["latency_ms"] for event in reports if event["latency_ms"] is not None]
    angles = [angle for event in reports if (angle := event.get("field_of_view")) is not None]
    found = Displays(
        drawn_by_browser=sum(event.get("draw") == "browser" for event in reports) / len(reports),
        display_renderer=statistics.mode(event["renderer"] for event in reports),
        display_width=median("width"),
        display_height=median("height"),
        display_pixel_ratio=median("pixel_ratio"),
        display_frames_per_s=median("frames_per_s"),
        display_frame_ms_95=median("frame_ms_95"),
        display_latency_ms=float(statistics.median(waits)) if waits else None,
        display_dropped=dropped / (shown + dropped) if dropped else 0.0,
        display_field_of_view=float(statistics.median(angles)) if angles else None,
    )
    return asdict(found)
