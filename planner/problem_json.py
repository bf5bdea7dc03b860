"""Convert routing problems, plans and certificates to and from JSON, for `mjsim plan`."""

import json
from typing import Annotated, Any, Literal, TypeVar

import msgspec
import numpy as np
from msgspec import Meta, Struct

from mjsim.support.files import read_json
from planner.errors import ProblemError
from planner.plan import Certificate, Plan, Proof, Status, Visit, VisitKind
from planner.problem import RoutingProblem, Shipment

FORMAT = 2
EXACT = 1 << 53  # every integer up to this value can be represented exactly as a float
PROBLEM = (
    'a problem is {"distances": [[0, 3], [3, 0]], "shipments": [{"pickup": 0, "delivery": 1}]}, '
    'and if need be "start": 0, "onboard": [1], "capacity": 2'
)
CLAIM = "a claim is what `mjsim plan --certificate` writes"

Whole = Annotated[int, Meta(ge=-EXACT, le=EXACT)]
Action = Literal["pick", "place", "place onboard"]
T = TypeVar("T")


class _Shipment(Struct, forbid_unknown_fields=True):
    pickup: int
    delivery: int


class _Problem(Struct, forbid_unknown_fields=True):
    distances: list[list[float]]
    shipments: list[_Shipment]
    start: int = 0
    onboard: tuple[int, ...] = ()
    capacity: int = 2


class _Certificate(Struct, forbid_unknown_fields=True):
    proof: Proof
    unit: float
    root: Whole
    groups: tuple[tuple[Whole, ...], ...]
    multipliers: tuple[Whole, ...]
    cuts: tuple[tuple[Whole, Whole, tuple[Whole, ...]], ...] = ()
    parts: Whole = 1
    branched: Whole = 0


class _Claim(Struct, forbid_unknown_fields=True):
    format: Literal[2]
    visits: list[tuple[Action, int]]
    cost: float
    lower_bound: float
    status: Status
    certificate: _Certificate | None


def problem_from_json(text: str | bytes) -> RoutingProblem:
    """Read a routing problem from JSON.

    The fields are `distances` in metres, `shipments` (`{"pickup": i, "delivery": j}`), `start` (0 by default),
    `onboard` (the delivery of each carried object, none by default) and `capacity` (2 by default). Indices refer to
    rows of `distances`.

    Raises:
        ProblemError: The text is not JSON, a field is missing, unknown or of the wrong type, or the problem is
            malformed. The message is one line.
    """
    raw = _decode(text, _Problem, PROBLEM)
    rows = raw.distances
    for i, row in enumerate(rows):
        if len(row) != len(rows):
            raise ProblemError(f"distances must be square, but row {i} has {len(row)} of {len(rows)} entries")
    distances = np.array(rows, dtype=np.float64).reshape(len(rows), len(rows))
    shipments = tuple(Shipment(s.pickup, s.delivery) for s in raw.shipments)
    return RoutingProblem(distances, raw.start, shipments, raw.onboard, raw.capacity)


def plan_to_json(problem: RoutingProblem, plan: Plan) -> str:
    """Return a plan as a JSON string. Visits are location indices, and lengths are in metres."""
    return json.dumps(
        {
            "visits": [problem.location(visit) for visit in plan.visits],
            "cost": plan.cost,
            "lower_bound": plan.lower_bound,
            "status": plan.status.value,
            "seconds": round(plan.seconds, 6),
        }
    )


def claim_to_json(problem: RoutingProblem, plan: Plan) -> str:
    """Return a plan and its certificate as a JSON string.

    A visit is `["pick", k]` or `["place", k]` for shipment k, or `["place onboard", k]` for the object k that is
    carried at the start. Both are numbered from 0.
    """
    fields = {name: getattr(plan, name) for name in ("cost", "lower_bound", "status", "certificate")}
    visits = [_action(problem, visit) for visit in plan.visits]
    written: Any = msgspec.to_builtins({"format": FORMAT, "visits": visits, **fields})
    if plan.certificate is not None and plan.certificate.proof is not Proof.CUTS:
        for name in ("cuts", "parts", "branched"):
            del written["certificate"][name]
    return json.dumps(written)


def claim_from_json(text: str | bytes, problem: RoutingProblem) -> Plan:
    """Read a plan that `claim_to_json` has written, without checking whether its claims are true.

    Raises:
        ProblemError: The text is not JSON, a field is missing, unknown or of the wrong type, or a visit names an
            unknown object. The message is one line.
    """
    raw = _decode(text, _Claim, CLAIM)
    proof = raw.certificate
    certificate = None if proof is None else Certificate(**msgspec.structs.asdict(proof))
    visits = tuple(_visit(problem, k, *visit) for k, visit in enumerate(raw.visits))
    return Plan(visits, raw.cost, raw.lower_bound, raw.status, seconds=0.0, certificate=certificate)


def _decode(text: str | bytes, kind: type[T], hint: str) -> T:
    try:
        if isinstance(text, bytes):
            text = text.decode("utf-8-sig")
        found = msgspec.json.decode(text, type=kind)
        read_json(text)
        return found
    except UnicodeError as error:
        raise ProblemError(f"not UTF-8 ({error}); {hint}") from error
    except ValueError as error:  # the message contains the path and the type of the invalid value
        raise ProblemError(f"{error}; {hint}") from error
    except RecursionError as error:
        raise ProblemError(f"nested too deeply; {hint}") from error


def _action(problem: RoutingProblem, visit: Visit) -> tuple[Action, int]:
    number, n = problem.number[visit.object], len(problem.shipments)
    if number >= n:
        return "place onboard", number - n
    return ("pick" if visit.kind is VisitKind.PICK else "place"), number


def _visit(problem: RoutingProblem, k: int, action: Action, number: int) -> Visit:
    n = len(problem.shipments)
    count = len(problem.onboard) if action == "place onboard" else n
    if not 0 <= number < count:
        raise ProblemError(f"visits[{k}] has the number {number}, but the problem has {count} to {action}")
    return (
        problem.pick(number) if action == "pick" else problem.place(number + n * (action == "place onboard"))
    )
