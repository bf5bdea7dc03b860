"""The moves of a tour between places, where a place includes the contents of the person's hands.

With m bins and n objects, places are numbered as follows:

    b m + b    at bin b with empty hands
    b m + d    at bin b with an object for another bin d in hand
    m m + i    at object i with only this object in hand
    m m + n    at the root, where the tour starts

No place is at a second object, because the person always goes on to the bin of one of the two objects. The move that
picks up a second object therefore ends at this bin.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.exact.instance import FAR, Instance

NOWHERE = -1  # end of a move that is not possible
# Index of the moves that pick up nothing, which is the last one, and bin of the object in an empty hand
NOTHING = -1


class Moves(NamedTuple):
    """Ends and lengths of the moves from each place. A move has up to two possible ends. The others are `NOWHERE`.

    The moves with index `NOTHING` go to a bin and place all objects of this bin. Only at the root can there be two such
    bins. If a second object is picked up, the first end places the first object, and the second end the second.
    """

    bins: int  # number of bins
    end: NDArray[np.int64]  # place after picking up each object or nothing, shape (places, n + 1, 2)
    length: NDArray[np.int64]  # length of the way to this place, shape (places, n + 1, 2)
    # Column of each place in a row of `CostTable.entries`, shape (places - 1,). The root has none.
    column: NDArray[np.int64]


def moves_of(inst: Instance) -> Moves:
    n, m = inst.to_bin.shape
    bins, objects, root, carried = np.arange(m), np.arange(n), m * m + n, inst.carried
    # Bin of the object in hand at each place, and the places with an object in hand
    held = np.concatenate([np.tile(bins, m), inst.home, carried if carried.size == 1 else [NOTHING]])
    held[bins * (m + 1)] = NOTHING
    busy = np.flatnonzero(held != NOTHING)
    hand, home = held[busy, None], inst.home
    to_object = np.concatenate([np.repeat(inst.to_bin.T, m, axis=0), inst.between, inst.root[None]])
    to_bin = np.concatenate([np.repeat(inst.bins, m, axis=0), inst.to_bin, inst.root_bin[None]])
    end, length = np.full((root + 1, n + 1, 2), NOWHERE), np.zeros((root + 1, n + 1, 2), np.int64)
    end[:, :n, 0], length[:, :n] = m * m + objects, to_object[..., None]
    end[busy, :n, 0], end[busy, :n, 1] = hand * m + home, np.where(hand == home, NOWHERE, home * m + hand)
    length[busy, :n, 0] += inst.to_bin.T[held[busy]]
    length[busy, :n, 1] += inst.to_bin[objects, home]
    end[:, :n][to_object >= FAR] = NOWHERE
    end[busy, NOTHING, 0], length[busy, NOTHING, 0] = held[busy] * (m + 1), to_bin[busy, held[busy]]
    if carried.size == 2:
        end[root, NOTHING], length[root, NOTHING] = carried * m + carried[::-1], inst.root_bin[carried]
    column = np.concatenate([2 * m * bins[:, None] + bins, 2 * m * m + objects], axis=None)
    return Moves(m, end, length, column)
