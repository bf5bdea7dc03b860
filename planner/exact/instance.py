"""Convert routing problems with a capacity of one or two to arrays for the kernels."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.plan import Visit, VisitKind
from planner.problem import RoutingProblem

FAR = 1 << 59  # length greater than that of any tour
MAX_SEARCHED = 40  # maximum number of objects for beam searches, whose keys contain a bit for each object


class Instance(NamedTuple):
    """A routing problem with n objects, m bins and a root (the person's position), in integer units.

    Legs that the capacity does not allow have the length `FAR`, so the same kernels handle both capacities.
    """

    between: NDArray[np.int64]  # distances between objects, shape (n, n); `FAR` on the diagonal
    to_bin: NDArray[np.int64]  # distances from objects to bins, shape (n, m)
    bins: NDArray[np.int64]  # distances between bins, shape (m, m)
    home: NDArray[np.int64]  # bin of each object, shape (n,)
    root: NDArray[np.int64]  # distances from the root to objects, shape (n,)
    root_bin: NDArray[np.int64]  # distances from the root to bins, shape (m,)
    carried: NDArray[np.int64]  # bins of the objects carried at the root, at most two
    tie: int  # maximum difference between tours that count as equal, in units
    unit: float  # length of one unit in metres


def make_instance(problem: RoutingProblem, metric: NDArray[np.int64]) -> Instance:
    """Convert a problem with a capacity of one or two. `metric` is its matrix of integer distances (k, k).

    Objects are the shipments, and bins are the delivery locations in ascending order.
    """
    pickups = [s.pickup for s in problem.shipments]
    places = sorted({s.delivery for s in problem.shipments} | set(problem.onboard))
    index = {location: k for k, location in enumerate(places)}

    def block(rows: list[int], columns: list[int]) -> NDArray[np.int64]:
        return metric[np.ix_(rows, columns)]

    between, root = block(pickups, pickups), block([problem.start], pickups)[0]
    np.fill_diagonal(between, FAR)
    if problem.capacity == 1:
        between[:] = FAR
    if len(problem.onboard) == problem.capacity:
        root[:] = FAR
    return Instance(
        between=between,
        to_bin=block(pickups, places),
        bins=block(places, places),
        home=np.array([index[s.delivery] for s in problem.shipments], dtype=np.int64),
        root=root,
        root_bin=block([problem.start], places)[0],
        carried=np.array([index[j] for j in problem.onboard], dtype=np.int64),
        tie=problem.integers.tie,
        unit=problem.integers.unit,
    )


def to_visits(
    instance: Instance, actions: Sequence[int], names: Sequence[str], carried: Sequence[str]
) -> list[Visit]:
    """Convert actions to visits. Action k >= 0 picks up object k, and -1 - b places all objects of bin b."""
    held = list(zip(instance.carried.tolist(), carried, strict=True))
    visits: list[Visit] = []
    for action in actions:
        if action >= 0:
            visits.append(Visit(VisitKind.PICK, names[action]))
            held.append((int(instance.home[action]), names[action]))
        else:
            visits += [Visit(VisitKind.PLACE, name) for b, name in held if b == -1 - action]
            held = [(b, name) for b, name in held if b != -1 - action]
    return visits
