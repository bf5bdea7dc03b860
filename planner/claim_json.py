"""What a plan claims and what proves it as JSON: written beside an answer, read again by whoever checks it."""

import json
import math
from typing import Any

from planner.certificate import Certificate, Proof
from planner.errors import ProblemError
from planner.plan import Plan, Status, Visit
from planner.problem import RoutingProblem
from planner.tour import pick, place, place_onboard

FORMAT = 1
LARGEST = 1 << 53  # whole numbers up to here are exact as floats
FIELDS = ("format", "visits", "cost", "lower_bound", "status", "certificate")
CERTIFICATE_FIELDS = ("proof", "root", "groups", "multipliers")


def claim_to_json(plan: Plan) -> str:
    """Write a plan with its certificate.

    A visit is `["pick", k]` or `["place", k]` of shipment k, or `["place onboard", k]` of what was carried at the
    start, k counting from 0 as in the problem.
    """
    certificate = plan.certificate
    raw = None
    if certificate is not None:
        raw = {
            "proof": certificate.proof.value,
            "root": certificate.root,
            "groups": [list(members) for members in certificate.groups],
            "multipliers": list(certificate.multipliers),
        }
    return json.dumps(
        {
            "format": FORMAT,
            "visits": [_visit_to_json(visit) for visit in plan.visits],
            "cost": plan.cost,
            "lower_bound": plan.lower_bound,
            "status": plan.status.value,
            "certificate": raw,
        }
    )


def claim_from_json(text: str, problem: RoutingProblem) -> Plan:
    """Read what `claim_to_json` wrote about a plan of this problem; nothing of it is believed yet.

    Raises:
        ProblemError: Not JSON, a field is missing, unknown or ill-typed, or a visit is of no object of the problem; one
            line that names the fault.
    """
    try:
        raw = json.loads(text)
    except json.JSONDecodeError as error:
        raise ProblemError(f"not JSON: {error}") from error
    fields = _fields("a claim", raw, FIELDS)
    if fields["format"] != FORMAT:
        raise ProblemError(f"format must be {FORMAT}, got {json.dumps(fields['format'])}")
    visits = tuple(
        _visit(f"visits[{k}]", v, problem) for k, v in enumerate(_list("visits", fields["visits"]))
    )
    return Plan(
        visits,
        _number("cost", fields["cost"]),
        _number("lower_bound", fields["lower_bound"]),
        _choice("status", fields["status"], Status),
        seconds=0.0,
        certificate=None if fields["certificate"] is None else _certificate(fields["certificate"]),
    )


def _certificate(raw: Any) -> Certificate:
    fields = _fields("a certificate", raw, CERTIFICATE_FIELDS)
    return Certificate(
        _choice("certificate.proof", fields["proof"], Proof),
        _whole("certificate.root", fields["root"]),
        tuple(
            _numbers(f"certificate.groups[{k}]", members)
            for k, members in enumerate(_list("certificate.groups", fields["groups"]))
        ),
        _numbers("certificate.multipliers", fields["multipliers"]),
    )


def _visit_to_json(visit: Visit) -> list[Any]:
    if visit.shipment is None:
        return ["place onboard", visit.onboard]
    return [visit.kind.value, visit.shipment]


def _visit(name: str, raw: Any, problem: RoutingProblem) -> Visit:
    makers = {
        "pick": (pick, len(problem.shipments)),
        "place": (place, len(problem.shipments)),
        "place onboard": (place_onboard, len(problem.onboard)),
    }
    if not isinstance(raw, list) or len(raw) != 2 or raw[0] not in list(makers):
        raise ProblemError(f"{name} must be one of {list(makers)} and a number, got {json.dumps(raw)}")
    make, count = makers[raw[0]]
    index = _whole(f"{name}[1]", raw[1])
    if not 0 <= index < count:
        raise ProblemError(f"{name} is of number {index}, but the problem has {count} to {raw[0]}")
    return make(problem, index)


def _fields(what: str, raw: Any, names: tuple[str, ...]) -> dict[str, Any]:
    if not isinstance(raw, dict) or set(raw) != set(names):
        found = sorted(raw) if isinstance(raw, dict) else type(raw).__name__
        raise ProblemError(f"{what} is a JSON object with {list(names)}, got {found}")
    return raw


def _choice(name: str, raw: Any, kind: Any) -> Any:
    values = [member.value for member in kind]
    if raw not in values:
        raise ProblemError(f"{name} must be one of {values}, got {json.dumps(raw)}")
    return kind(raw)


def _list(name: str, raw: Any) -> list[Any]:
    if not isinstance(raw, list):
        raise ProblemError(f"{name} must be a list, got {json.dumps(raw)}")
    return raw


def _whole(name: str, raw: Any) -> int:
    if isinstance(raw, bool) or not isinstance(raw, int) or abs(raw) > LARGEST:
        raise ProblemError(f"{name} must be a whole number up to 2^53, got {json.dumps(raw)}")
    return raw


def _numbers(name: str, raw: Any) -> tuple[int, ...]:
    return tuple(_whole(f"{name}[{k}]", value) for k, value in enumerate(_list(name, raw)))


def _number(name: str, raw: Any) -> float:
    if isinstance(raw, bool) or not isinstance(raw, int | float) or not math.isfinite(raw):
        raise ProblemError(f"{name} must be a finite number, got {json.dumps(raw)}")
    return float(raw)
