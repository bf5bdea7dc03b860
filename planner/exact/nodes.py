"""A layer of search states, with a hash table that finds a state by its code."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import inlined, kernel
from planner.exact.table import INFINITE

NO_PARENT = -1
FIRST_ROOM = 1 << 12  # initial capacity of a layer in states


class Nodes(NamedTuple):
    """The states of a search layer. The arrays contain unused entries at the end."""

    size: NDArray[np.int64]  # number of states, shape (1,)
    key: NDArray[np.int64]  # code of each state, as defined in `expand`
    cost: NDArray[np.int64]  # length of the shortest known path to each state
    total: NDArray[np.int64]  # cost plus a lower bound on the cost-to-go
    # Twice the index of the previous state, plus 1 if that state is in the same layer, or `NO_PARENT`
    parent: NDArray[np.int64]
    slots: NDArray[np.int32]  # hash table of state indices, -1 if empty; its length is a power of two


@kernel
def new_nodes(room: int) -> Nodes:
    """Return an empty layer with space for `room` states. `room` must be a power of two."""
    return Nodes(
        np.zeros(1, np.int64),
        np.empty(room, np.int64),
        np.empty(room, np.int64),
        np.empty(room, np.int64),
        np.empty(room, np.int64),
        np.full(2 * room, -1, np.int32),
    )


@inlined
def slot_of(nodes: Nodes, key: int) -> int:
    """Return the hash table slot of a key, or the empty slot where the key belongs."""
    mask = nodes.slots.size - 1
    mixed = np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)
    slot = int(mixed >> np.uint64(29)) & mask
    while nodes.slots[slot] >= 0 and nodes.key[nodes.slots[slot]] != key:
        slot = (slot + 1) & mask
    return slot


@inlined
def offer(nodes: Nodes, key: int, cost: int, total: int, parent: int) -> None:
    """Add a state, or update it if the new path is shorter. The layer must have free space."""
    slot = slot_of(nodes, key)
    k = nodes.slots[slot]
    if k < 0:
        k = nodes.size[0]
        nodes.size[0] = k + 1
        nodes.slots[slot] = k
        nodes.key[k] = key
    elif cost >= nodes.cost[k]:
        return
    nodes.cost[k] = cost
    nodes.total[k] = total
    nodes.parent[k] = parent


@kernel
def with_room(nodes: Nodes, more: int) -> Nodes:
    size = nodes.size[0]
    room = nodes.key.size
    if size + more <= room:
        return nodes
    while size + more > room:
        room *= 2
    wider = new_nodes(room)
    for k in range(size):
        offer(wider, nodes.key[k], nodes.cost[k], nodes.total[k], nodes.parent[k])
    return wider


@kernel
def keep_best(nodes: Nodes, width: int) -> tuple[Nodes, int]:
    """Return the `width` best states, and the smallest total among the dropped states or `INFINITE`."""
    size = nodes.size[0]
    if size <= width:
        return nodes, INFINITE
    bar = np.partition(nodes.total[:size], width - 1)[width - 1]
    ties = width
    for k in range(size):
        if nodes.total[k] < bar:
            ties -= 1
    room = 1
    while room < 2 * width:
        room *= 2
    kept, smallest = new_nodes(room), INFINITE
    for k in range(size):
        if nodes.total[k] == bar and ties > 0:
            ties -= 1
        elif nodes.total[k] >= bar:
            smallest = min(smallest, nodes.total[k])
            continue
        offer(kept, nodes.key[k], nodes.cost[k], nodes.total[k], nodes.parent[k])
    return kept, smallest


@kernel
def with_room_among(nodes: Nodes, more: int, width: int) -> tuple[Nodes, int]:
    """Make space for `more` states. If necessary, drop states that cannot be among the best `width`."""
    smallest = INFINITE
    if nodes.size[0] + more > nodes.key.size and nodes.size[0] > 4 * width:
        nodes, smallest = keep_best(nodes, 2 * width)
    return with_room(nodes, more), smallest
