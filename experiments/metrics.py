"""The paper's metrics, from the event log and the trajectory alone (PAPER section 6)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.records import Event

REGRETFUL = 0.01  # m


@dataclass(frozen=True)
class Metrics:
    """Objective measures of one trial.

    Attributes:
        delivered: Objects in their receptacle at the end.
        normalized_deviations: Visits that differ from the suggested next visit, over the visits at which another
            one was feasible; 0 when there was never a choice.
        inverse_path_length: Geodesic distance between consecutive visits over the distance walked; 1 is perfect.
        task_distance_m: Distance walked, m.
        completion_time_s: Time until the last object was delivered, or until the end if some are left, s.
        optimal_distance_m: Cost of the plan at the start, m.
        replans: How often the plan was made anew after the first, because the task was no longer as planned.
        refusals: Infeasible attempts.
        failures: Picks and places that were begun but did not succeed in the physics, and objects lost from a hand.
        mean_regret_m: By how much a visit makes the rest of the task longer than the best one at that moment, m; the
            mean of all visits whose regret is known, None if there is none.
        total_regret_m: Their sum, m: how much longer the walk is for the order of visits alone; or None.
        regretful_visits: Visits with a regret of more than 1 cm. The others are optimal or tie with the optimal one.
        unjudged_visits: Visits whose regret is not known: the planner could not prove it, or it was not asked for.
    """

    delivered: int
    normalized_deviations: float
    inverse_path_length: float
    task_distance_m: float
    completion_time_s: float
    optimal_distance_m: float
    replans: int
    refusals: int
    failures: int
    mean_regret_m: float | None
    total_regret_m: float | None
    regretful_visits: int
    unjudged_visits: int


def compute_metrics(events: Sequence[Event], positions: NDArray[np.float64]) -> Metrics:
    """Measure a trial.

    A visit takes place where the person stood, not where the object lay, because objects are picked from up to a
    metre away. The geodesic between these places, for the body's own radius, is the shortest walk that joins them,
    so the inverse path length never exceeds 1.

    Args:
        events: The event log in order; it ends with `end`, at the moment of the last delivery if that is why.
        positions: Floor position at every control step, m, shape (T, 2).
    """
    visits = [e for e in events if e["event"] == "visit"]
    plans = [e for e in events if e["event"] == "plan"]
    choices = [v for v in visits if v["alternatives"] > 0]
    deviations = sum(v["deviated"] for v in choices)
    walked = float(np.linalg.norm(np.diff(positions, axis=0), axis=1).sum()) if len(positions) > 1 else 0.0
    shortest = float(sum(v["geodesic_m"] for v in visits))
    delivered = [e for e in events if e["event"] == "placed"]
    dislodged = sum(e["event"] == "dislodged" for e in events)
    regrets = _regrets(events, visits)
    return Metrics(
        delivered=len(delivered) - dislodged,
        normalized_deviations=deviations / len(choices) if choices else 0.0,
        inverse_path_length=shortest / walked if walked > 0 else 1.0,
        task_distance_m=walked,
        completion_time_s=float(events[-1]["t"]),
        optimal_distance_m=float(plans[0]["cost_m"]) if plans else 0.0,
        replans=max(sum(not p.get("improved", False) for p in plans) - 1, 0),
        refusals=sum(e["event"] == "attempt" and not e["applied"] for e in events),
        failures=sum(e["event"] in ("pick_failed", "place_failed", "grip_lost") for e in events),
        mean_regret_m=sum(regrets) / len(regrets) if regrets else None,
        total_regret_m=sum(regrets) if regrets else None,
        regretful_visits=sum(regret > REGRETFUL for regret in regrets),
        unjudged_visits=len(visits) - len(regrets),
    )


def _regrets(events: Sequence[Event], visits: Sequence[Event]) -> list[float]:
    """Regrets that are known, m: logged with the visit, or later under its number."""
    found = {k: visit.get("regret_m") for k, visit in enumerate(visits)}
    found |= {e["visit"]: e["regret_m"] for e in events if e["event"] == "regret"}
    return [float(regret) for regret in found.values() if regret is not None]
