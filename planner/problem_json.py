"""Routing problems as JSON: what `mjsim plan` reads and answers."""

import json
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import ProblemError
from planner.plan import Plan
from planner.problem import RoutingProblem, Shipment

FIELDS = {"capacity", "start", "distances", "shipments", "onboard"}


def problem_from_json(text: str) -> RoutingProblem:
    """Read a problem: capacity, start, distances, shipments (`{"pickup": i, "delivery": j}`), onboard (`[j, ...]`).

    `capacity` defaults to 2, `start` to 0, `onboard` to nothing. Indices count the rows of `distances`, in metres;
    `onboard` holds the delivery of each carried object.

    Raises:
        ProblemError: Not JSON, a field is missing, unknown or ill-typed, or the problem is malformed; one line that
            names the fault.
    """
    try:
        raw = json.loads(text)
    except json.JSONDecodeError as error:
        raise ProblemError(f"not JSON: {error}") from error
    if not isinstance(raw, dict):
        raise ProblemError(f"a problem is a JSON object with {sorted(FIELDS)}, got {_kind(raw)}")
    if unknown := sorted(set(raw) - FIELDS):
        raise ProblemError(f"unknown field {unknown[0]!r}; a problem has {sorted(FIELDS)}")
    for name in ("distances", "shipments"):
        if name not in raw:
            raise ProblemError(f"field {name!r} is missing")
    return RoutingProblem(
        distances=_matrix(raw["distances"]),
        start=_index("start", raw.get("start", 0)),
        shipments=tuple(_shipment(k, s) for k, s in enumerate(_list("shipments", raw["shipments"]))),
        onboard=tuple(
            _index(f"onboard[{k}]", j) for k, j in enumerate(_list("onboard", raw.get("onboard", [])))
        ),
        capacity=_index("capacity", raw.get("capacity", 2)),
    )


def plan_to_json(plan: Plan) -> str:
    """Write the visits (location indices), cost, lower bound (m), status and seconds of a plan."""
    return json.dumps(
        {
            "visits": [visit.location for visit in plan.visits],
            "cost": plan.cost,
            "lower_bound": plan.lower_bound,
            "status": plan.status.value,
            "seconds": round(plan.seconds, 6),
        }
    )


def _matrix(rows: Any) -> NDArray[np.float64]:
    rows = _list("distances", rows)
    for i, row in enumerate(rows):
        if len(_list(f"distances[{i}]", row)) != len(rows):
            raise ProblemError(f"distances must be square, but row {i} has {len(row)} of {len(rows)} entries")
        for j, value in enumerate(row):
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                raise ProblemError(f"distances[{i}][{j}] must be a finite number, got {json.dumps(value)}")
    return np.array(rows, dtype=np.float64).reshape(len(rows), len(rows))


def _shipment(k: int, raw: Any) -> Shipment:
    if not isinstance(raw, dict) or set(raw) != {"pickup", "delivery"}:
        raise ProblemError(f'shipments[{k}] must be {{"pickup": i, "delivery": j}}, got {json.dumps(raw)}')
    return Shipment(
        _index(f"shipments[{k}].pickup", raw["pickup"]), _index(f"shipments[{k}].delivery", raw["delivery"])
    )


def _index(name: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise ProblemError(f"{name} must be a whole number, got {json.dumps(value)}")
    return value


def _list(name: str, value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise ProblemError(f"{name} must be a list, got {_kind(value)}")
    return value


def _kind(value: Any) -> str:
    return {dict: "an object", list: "a list", str: "a string", type(None): "null"}.get(
        type(value), "a number"
    )
