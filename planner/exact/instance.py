"""A routing problem for capacity two as the flat arrays that the exact kernels work on."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.plan import Visit, VisitKind
from planner.problem import RoutingProblem

FAR = 1 << 28


class Instance(NamedTuple):
    """n objects, m bins and the root (where the person is), distances in integer units.

    Attributes:
        between: Object to object, (n, n) int32; `FAR` from an object to itself.
        to_bin: Object to bin, (n, m) int32.
        from_bin: Bin to object, (m, n) int32.
        bins: Bin to bin, (m, m) int32.
        home: Bin of each object, (n,) int64.
        root: Root to object, (n,) int32.
        root_bin: Root to bin, (m,) int32.
        carried: Bins of the objects carried at the root, (0..2,) int64.
    """

    between: NDArray[np.int32]
    to_bin: NDArray[np.int32]
    from_bin: NDArray[np.int32]
    bins: NDArray[np.int32]
    home: NDArray[np.int64]
    root: NDArray[np.int32]
    root_bin: NDArray[np.int32]
    carried: NDArray[np.int64]


def make_instance(problem: RoutingProblem, metric: NDArray[np.int64]) -> Instance:
    """Flatten a problem; objects are its shipments, bins its delivery locations in ascending order.

    Args:
        problem: Of capacity two.
        metric: Its distances, units of 0.1 mm, closed to a metric, (k, k).
    """
    pickups = [s.pickup for s in problem.shipments]
    places = sorted({s.delivery for s in problem.shipments} | set(problem.onboard))
    index = {location: k for k, location in enumerate(places)}

    n, m = len(pickups), len(places)

    def block(rows: list[int], columns: list[int], height: int, width: int) -> NDArray[np.int32]:
        result = np.full((height, width), FAR, dtype=np.int32)
        result[: len(rows), : len(columns)] = metric[np.ix_(rows, columns)]
        return result

    between = block(pickups, pickups, n, n)
    np.fill_diagonal(between, FAR)
    return Instance(
        between=between,
        to_bin=block(pickups, places, n, m),
        from_bin=block(places, pickups, m, n),
        bins=block(places, places, m, m),
        home=np.array([index[s.delivery] for s in problem.shipments], dtype=np.int64),
        root=block([problem.start], pickups, 1, n)[0],
        root_bin=block([problem.start], places, 1, m)[0],
        carried=np.array([index[j] for j in problem.onboard], dtype=np.int64),
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
