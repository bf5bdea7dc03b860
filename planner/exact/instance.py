"""A routing problem for capacity two as the flat arrays that the exact kernels work on."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.plan import Visit, VisitKind
from planner.problem import RoutingProblem

FAR = 1 << 59  # longer than any tour


class Instance(NamedTuple):
    """n objects, m bins and the root (where the person is); distances in integer units, int64.

    Attributes:
        between: Object to object, (n, n); `FAR` from an object to itself.
        to_bin: Object to bin, (n, m).
        from_bin: Bin to object, (m, n).
        bins: Bin to bin, (m, m).
        home: Bin of each object, (n,) int64.
        root: Root to object, (n,).
        root_bin: Root to bin, (m,).
        carried: Bins of the objects carried at the root, (0..2,) int64.
        tie: Tours that differ by no more than this are equal, units.
        unit: m per unit.
    """

    between: NDArray[np.int64]
    to_bin: NDArray[np.int64]
    from_bin: NDArray[np.int64]
    bins: NDArray[np.int64]
    home: NDArray[np.int64]
    root: NDArray[np.int64]
    root_bin: NDArray[np.int64]
    carried: NDArray[np.int64]
    tie: int
    unit: float


def make_instance(problem: RoutingProblem, metric: NDArray[np.int64]) -> Instance:
    """Flatten a problem; objects are its shipments, bins its delivery locations in ascending order.

    Args:
        problem: Of capacity two.
        metric: Its integer distances, closed to a metric, (k, k).
    """
    pickups = [s.pickup for s in problem.shipments]
    places = sorted({s.delivery for s in problem.shipments} | set(problem.onboard))
    index = {location: k for k, location in enumerate(places)}

    def block(rows: list[int], columns: list[int]) -> NDArray[np.int64]:
        return metric[np.ix_(rows, columns)]

    between = block(pickups, pickups)
    np.fill_diagonal(between, FAR)
    return Instance(
        between=between,
        to_bin=block(pickups, places),
        from_bin=block(places, pickups),
        bins=block(places, places),
        home=np.array([index[s.delivery] for s in problem.shipments], dtype=np.int64),
        root=block([problem.start], pickups)[0],
        root_bin=block([problem.start], places)[0],
        carried=np.array([index[j] for j in problem.onboard], dtype=np.int64),
        tie=problem.integers.tie,
        unit=problem.integers.unit,
    )


def to_visits(
    instance: Instance, actions: Sequence[int], names: Sequence[str], carried: Sequence[str]
) -> list[Visit]:
    """Turn actions into visits.

    Args:
        instance: What the actions are of.
        actions: k >= 0 picks object k, -1 - b goes to bin b and leaves all that belongs there.
        names: Of the objects of the instance.
        carried: Names of what is carried at the root.
    """
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
