"""Compiled kernels that fill a table of `planner.exact.table`, and follow a best tour in it."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.kernels import inlined, kernel
from planner.exact.deadline import NEVER, Deadline
from planner.exact.instance import FAR, Instance
from planner.exact.lanes import LANES, copy, least, load, plus, repeat, store
from planner.exact.table import Table

Entries = NDArray[np.integer[Any]]
SLICE = 1 << 13  # rows that are filled between looks at the clock: some 3 ms


@kernel
def row_without(table: Table, row: int, j: int) -> int:
    """Row after picking j, or -1 where none of its group is left."""
    left = row // table.stride[j] % (table.size[table.group[j]] + 1)
    return int(row - table.stride[j]) if left else -1


@kernel
def after_pick(inst: Instance, table: Table, row: int, j: int, d: int) -> int:
    """W with its pick: at j with it and one object for d, where `row` no longer has j."""
    c = inst.home[j]
    first = inst.to_bin[j, d] + table.bin[row, d, c]
    second = inst.to_bin[j, c] + table.bin[row, c, d]
    return int(table.multipliers[j] + min(first, second))


def fill(inst: Instance, table: Table, deadline: Deadline = NEVER) -> bool:
    """Compute all rows, smaller ones first; whether that was done before the deadline."""
    rows = table.bin.shape[0]
    table.multipliers[:] = np.clip(table.multipliers, -table.dearest, table.dearest)
    for first in range(0, rows, SLICE):
        if first and deadline.over():
            return False
        fill_rows(inst, table, first, min(rows, first + SLICE))
    return True


@kernel
def left_of(table: Table, row: int) -> NDArray[np.int64]:
    """How many of each group are left in a row, shape (groups,)."""
    left = np.empty(table.size.size, np.int64)
    for g in range(left.size):
        left[g] = row % (table.size[g] + 1)
        row //= table.size[g] + 1
    return left


@inlined
def count_on(table: Table, left: NDArray[np.int64]) -> None:
    """Update the numbers left of each group, shape (groups,), from a row to the next."""
    for g in range(left.size):
        left[g] += 1
        if left[g] <= table.size[g]:
            break
        left[g] = 0


class Legs(NamedTuple):
    """Distances of an instance for `fill_rows`, flat. Those to bins stand in as many lanes as whole eights hold them.

    Attributes:
        to_bin: From each object to bins, (n lanes,).
        from_bin: From bins to each object with its price, (n lanes,).
        bins: Between bins, (m lanes,).
        between: From each object to the bin of the object of each place; then to each object, with its price, from
            the object of each place, (1 + n) places.
        place: Of each object; those of one bin have eights of their own, (n,) int64.
        bin_of: Bin of the objects of each eight of places, (places / 8,) int64.
        down: How many entries further down V(., b, .) is, for bin b of an object, where that was picked, (n,) int64.
        far: Longer than any tour, (1,).
    """

    to_bin: Entries
    from_bin: Entries
    bins: Entries
    between: Entries
    place: NDArray[np.int64]
    bin_of: NDArray[np.int64]
    down: NDArray[np.int64]
    far: Entries


@kernel
def legs_of(inst: Instance, table: Table) -> Legs:
    """The distances, of the type of the table's entries."""
    n, m = inst.to_bin.shape
    wide = lanes_for(m)
    dtype = table.entries.dtype
    kind, price = dtype.type, table.multipliers
    far = np.full(1, 1 << 30 if table.entries.itemsize == 4 else FAR, dtype)
    to_bin, from_bin = np.zeros(n * wide, dtype), np.zeros(n * wide, dtype)
    bins = np.zeros(m * wide, dtype)
    for b in range(m):
        for j in range(n):
            to_bin[j * wide + b] = kind(inst.to_bin[j, b])
            from_bin[j * wide + b] = kind(inst.from_bin[b, j] + price[j])
        for d in range(m):
            bins[b * wide + d] = kind(inst.bins[b, d])
    place, bin_of = np.empty(n, np.int64), np.empty(n, np.int64)
    eights = 0
    for b in range(m):
        free = 0
        for j in range(n):
            if inst.home[j] == b:
                if free == 0:
                    bin_of[eights] = b
                    eights, free = eights + 1, LANES
                place[j] = eights * LANES - free
                free -= 1
    places = eights * LANES
    between = np.zeros((1 + n) * places, dtype)
    for i in range(n):
        between[place[i]] = kind(inst.to_bin[i, inst.home[i]])
        for j in range(n):
            between[(1 + j) * places + place[i]] = kind(min(inst.between[i, j], far[0])) + kind(price[j])
    down = table.stride * (2 * m * m + n) - 2 * m * inst.home
    return Legs(to_bin, from_bin, bins, between, place, bin_of[:eights], down, far)


class Row(NamedTuple):
    """What is worked out for a row; of the objects that can be picked, in the order of `which`.

    Attributes:
        which: Numbers of those objects, (n,) int64.
        second: W without the price of its pick, lanes of the bins of the other object, (n lanes,).
        empty: E, (lanes,).
        carrying: V, lanes, (m lanes,).
        holding: Y, in the places of `Legs`, (places,).
    """

    which: NDArray[np.int64]
    second: Entries
    empty: Entries
    carrying: Entries
    holding: Entries


@inlined
def lanes_for(m: int) -> int:
    """How many lanes whole eights for so many bins have."""
    return (m + LANES - 1) // LANES * LANES


@kernel
def fill_rows(inst: Instance, table: Table, first: int, last: int) -> None:
    """Compute some rows; all before must have been.

    Bins and the objects of a bin are taken eight at a time. Of lanes without a bin or an object nothing is used.
    """
    n, m = inst.to_bin.shape
    legs = legs_of(inst, table)
    wide, dtype = lanes_for(m), table.entries.dtype
    here = Row(
        np.empty(n, np.int64),
        np.empty(n * wide, dtype),
        np.empty(wide, dtype),
        np.empty(m * wide, dtype),
        np.empty(legs.bin_of.size * LANES, dtype),
    )
    left = left_of(table, first)
    for row in range(first, last):
        count = _pick(inst, table, legs, left, row, here)
        _carry(table, legs, row, count, here)
        _hold(table, legs, row, count, here)
        count_on(table, left)


@inlined
def _pick(inst: Instance, table: Table, legs: Legs, left: NDArray[np.int64], row: int, here: Row) -> int:
    """W of every object that can be picked in a row, and E; returns how many can."""
    n, m = inst.to_bin.shape
    wide, width, entries = lanes_for(m), 2 * m * m + n, table.entries
    count = 0
    for d in range(0, wide, LANES):
        count = 0
        empty = repeat(legs.far, 0)
        for j in range(n):
            if left[table.group[j]] == 0:
                continue
            at = row * width - legs.down[j] + d
            own = plus(repeat(legs.to_bin, j * wide + inst.home[j]), load(entries, at))
            other = plus(load(legs.to_bin, j * wide + d), load(entries, at + m))
            store(here.second, count * wide + d, least(own, other))
            only = repeat(entries, (row - table.stride[j]) * width + 2 * m * m + j)
            empty = least(empty, plus(load(legs.from_bin, j * wide + d), only))
            here.which[count] = j
            count += 1
        store(here.empty, d, empty)
    if row == 0:
        here.empty[:] = 0
    return count


@inlined
def _carry(table: Table, legs: Legs, row: int, count: int, here: Row) -> None:
    """V of a row, into the table, and E too."""
    m, entries = table.bin.shape[1], table.entries
    wide, start = lanes_for(m), row * (2 * m * m + table.stride.size)
    for b in range(m):
        for d in range(0, wide, LANES):
            carrying = plus(load(legs.bins, b * wide + d), load(here.empty, d))
            for k in range(count):
                leg = repeat(legs.from_bin, here.which[k] * wide + b)
                carrying = least(carrying, plus(leg, load(here.second, k * wide + d)))
            store(here.carrying, b * wide + d, carrying)
            store(entries, start + 2 * m * b + d, carrying)
        copy(entries, start + (2 * m + 1) * b, here.empty, b)
    for b in range(m):
        for d in range(m):
            copy(entries, start + (2 * b + 1) * m + d, here.carrying, d * wide + b)
        copy(entries, start + (2 * b + 1) * m + b, here.empty, b)


@inlined
def _hold(table: Table, legs: Legs, row: int, count: int, here: Row) -> None:
    """Y of a row, into the table; it means something for objects of which some of the group were picked."""
    m, entries = table.bin.shape[1], table.entries
    n, wide, places = table.stride.size, lanes_for(m), here.holding.size
    for eight in range(legs.bin_of.size):
        b = legs.bin_of[eight]
        holding = plus(load(legs.between, LANES * eight), repeat(here.empty, b))
        for k in range(count):
            leg = load(legs.between, (1 + here.which[k]) * places + LANES * eight)
            holding = least(holding, plus(leg, repeat(here.second, k * wide + b)))
        store(here.holding, LANES * eight, holding)
    start = row * (2 * m * m + n) + 2 * m * m
    for i in range(n):
        copy(entries, start + i, here.holding, legs.place[i])
