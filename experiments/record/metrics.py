"""The objective measures of a trial, from the event log and the trajectory alone (PAPER section 6, docs/metrics.md)."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.record.displays import displays
from experiments.record.health import summarise_health
from experiments.record.phases import FLYTHROUGH, is_simulated
from experiments.record.records import PARTICIPANT, PHASE_ENDED, Event
from mjsim.values.motion_parameters import GROUPS

REGRETFUL = 0.01  # m; smaller regrets are ties
COSTLY = 0.1  # m; what a deviation must cost to count in `nd_regret_10cm`
# Fields of the start event that say what was recorded, not how the trial was set up.
PROVENANCE = frozenset(
    {
        "t",
        "event",
        "format",
        "versions",
        "model",
        "world",
        "inputs",
        "episode_sha256",
        "order",
        "person",
        "behaviour",
    }
)
# Fields of `metrics.json` that do not follow from log and trajectory; the checksum of the file protects them.
CIRCUMSTANCES = ("frames_sha256", "renderer", "wall_s")


@dataclass(frozen=True)
class Metrics:
    """Objective measures of one trial; docs/metrics.md defines each.

    Attributes:
        ended: Why the trial ended.
        delivered: Objects in their receptacle at the end.
        visits: Successful picks and places.
        nd_strict_2n: Visits that differ from the suggested next one, over two per object of the task; None, as are
            the other deviations and inverse path lengths, where no visit was made.
        nd_feasible: Visits that differ from the suggested next one, over the visits at which another one was feasible;
            0 when there was never a choice.
        nd_bin_tied: As `nd_feasible`, but which of two objects goes first into the same bin is no choice.
        nd_regret_10cm: As `nd_feasible`, but only deviations that make the rest of the task more than 0.1 m longer
            than the best visit count, over the visits whose regret is known; None where none is known.
        ipl_locations: Sum of the distances between the places of consecutive visits (where objects lay, where one
            stands at a bin) over the distance walked: the paper's inverse path length. It can exceed 1.
        ipl_stand: Sum of the shortest walks between where the person stood at consecutive visits over the distance
            walked; 1 is perfect and never exceeded.
        task_distance_m: Distance walked, m.
        completion_time_s: Time until the last object was delivered, or until the end if some are left, s.
        completion_over_familiarisation: Completion time over the duration of the fly-through; None where there was
            none.
        planned_distance_m: Length of the plan at the start, from place to place, m. Who reaches walks less.
        reach_bound_m: Lower bound on walking at maximum reach, m; None where nothing was planned.
        replans: How often the plan was made anew after the first, because the task was no longer as planned.
        refusals: Infeasible attempts.
        failures: Picks and places that started but did not succeed in the physics, and objects lost from a hand.
        mean_regret_m: By how much a visit makes the rest of the task longer than the best one at that moment, m; the
            mean of all visits whose regret is known, None if there is none.
        total_regret_m: Their sum, m: how much longer the walk is for the order of visits alone; or None.
        regretful_visits: Visits with a regret of more than 1 cm, None if none is known. The
            others are optimal or tie with the optimal one.
        unjudged_visits: Visits whose regret is not known: the planner could not prove it, or it was not asked for.
        mean_suggestion_gap_m: Regret of what was suggested, m: the mean of all suggestions whose regret is known, None
            if there is none. It measures the planner, as `mean_regret_m` measures the person.
        max_suggestion_gap_m: The largest of them, m, or None.
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
    """Everything that a log and a trajectory say about a trial: its settings, its metrics, the health of the physics.

    Args:
        events: The event log in order, from `start` to `end`.
        arrays: The trajectory, columns as in `TRAJECTORY_COLUMNS`; at least one row.

    Returns:
        Rows of `metrics.json`.
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
    """Measure a trial.

    Args:
        events: The event log in order; it ends with `end`, at the moment of the last delivery if that is why.
        positions: Floor position at every control step, m, shape (T, 2).
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
        regretful_visits=sum(regret > REGRETFUL for regret in known) if known else None,
        unjudged_visits=len(visits) - len(known),
        mean_suggestion_gap_m=sum(gaps.values()) / len(gaps) if gaps else None,
        max_suggestion_gap_m=max(gaps.values(), default=None),
    )


def _person(events: Sequence[Event]) -> dict[str, Any]:
    """The participant's values, but for those of the hands, as columns: `person_walking_speed` and so on."""
    told: Mapping[str, Any] = next((e for e in events if e["event"] == PARTICIPANT), {"person": {}})
    body = {f"person_{name}": value for name, value in told["person"].items() if name not in GROUPS}
    model = told.get("behaviour") or {}
    return body | {f"behaviour_{name.replace('.', '_')}": value for name, value in model.items()}


def _count(events: Sequence[Event], *kinds: str) -> int:
    return sum(event["event"] in kinds for event in events)


def _over(part: float, whole: float, empty: float = 0.0) -> float:
    return part / whole if whole > 0 else empty


def _path_length(visits: Sequence[Event], between: str, walked: float) -> float | None:
    return _over(sum(visit[between] for visit in visits), walked, empty=1.0) if visits else None


def _choices(visits: Sequence[Event]) -> list[Event]:
    """Visits at which another one was feasible."""
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
    return _over(sum(v["deviated"] and regret > COSTLY for v, regret in judged), len(judged))


def _over_familiarisation(events: Sequence[Event], completion: float) -> float | None:
    """The fly-through is the paper's familiarisation."""
    ended = [e for e in events if e["event"] == PHASE_ENDED and e["phase"] == FLYTHROUGH]
    watched = sum(float(event["duration_s"]) for event in ended)
    return completion / watched if watched > 0 else None


def _regrets(events: Sequence[Event], visits: Sequence[Event], name: str) -> dict[int, float]:
    """Regrets that are known by number of the visit, m: logged with the visit, or later under its number."""
    found = {k: visit.get(name) for k, visit in enumerate(visits)}
    found |= {e["visit"]: e[name] for e in events if e["event"] == "regret" and name in e}
    return {k: float(regret) for k, regret in found.items() if regret is not None}
