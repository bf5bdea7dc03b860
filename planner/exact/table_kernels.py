"""Compiled kernels that fill cost-to-go tables and extract shortest tours from them.

The kernels process eight entries at a time, because LLVM does not vectorize loops over as few as six bins.
Filling a table one entry at a time would take 2.4 times as long. Array bounds are not checked.
"""

from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from mjsim.support.kernels import inlined, kernel
from planner.exact import table as tables
from planner.exact.instance import FAR, Instance
from planner.exact.table import CostTable

LANES = 8  # number of table entries processed at once

Entries = NDArray[np.integer[Any]]

walk = kernel(tables.walk)


def _min_plus(*, each: bool) -> Any:
    """Return an intrinsic for `out = min(out, a + b)` on eight entries, with a single `b` unless `each`."""

    def typed(_: Any, out: Any, _o: Any, a: Any, _i: Any, b: Any, _k: Any) -> Any:
        size = out.dtype.bitwidth // 8
        vector = ir.VectorType(ir.IntType(out.dtype.bitwidth), LANES)

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            def one(n: int) -> Any:
                array = context.make_array(signature.args[n])(context, builder, arguments[n])
                return builder.gep(array.data, [arguments[n + 1]])

            def lanes(n: int) -> Any:
                return builder.bitcast(one(n), vector.as_pointer())

            if each:
                added = builder.load(lanes(4), align=size)
            else:
                lane, nothing = ir.IntType(32), ir.Constant(vector, ir.Undefined)
                first = builder.insert_element(nothing, builder.load(one(4)), ir.Constant(lane, 0))
                every = ir.Constant(ir.VectorType(lane, LANES), [0] * LANES)
                added = builder.shuffle_vector(first, nothing, every)
            total = builder.add(builder.load(lanes(2), align=size), added)
            before = builder.load(lanes(0), align=size)
            least = builder.select(builder.icmp_signed("<", total, before), total, before)
            builder.store(least, lanes(0), align=size)
            return context.get_dummy_value()

        return types.void(out, types.intp, a, types.intp, b, types.intp), generate

    return intrinsic(typed)


min_plus = _min_plus(each=False)
min_plus_each = _min_plus(each=True)


def fill(inst: Instance, table: CostTable) -> None:
    table.multipliers[:] = np.clip(table.multipliers, -table.dearest, table.dearest)
    fill_rows(inst, table, 0, table.bin.shape[0])


class Legs(NamedTuple):
    """The distances of an instance as flat arrays for `fill_rows`.

    Rows with one entry per bin are padded to `lanes` entries, which is a multiple of eight.
    """

    to_bin: Entries  # distances from each object to all bins, shape (n * lanes,)
    from_bin: Entries  # distances from all bins to each object plus its price, shape (n * lanes,)
    bins: Entries  # distances between bins, shape (m * lanes,)
    # Distances from objects to their bins, then those between objects plus prices, shape ((1 + n) * places,)
    between: Entries
    # Index of each object in a row of `between`, shape (n,). Each bin starts at a multiple of eight.
    place: NDArray[np.int64]
    bin_of: NDArray[np.int64]  # bin of each group of eight entries in a row of `between`
    far: int  # length greater than that of any tour


@inlined
def lanes_for(m: int) -> int:
    return (m + LANES - 1) // LANES * LANES


@kernel
def legs_of(inst: Instance, table: CostTable) -> Legs:
    n, m = inst.to_bin.shape
    wide, dtype = lanes_for(m), table.entries.dtype
    far = (1 << 30) if table.entries.itemsize == 4 else FAR
    to_bin, from_bin = np.zeros(n * wide, dtype), np.zeros(n * wide, dtype)
    bins = np.zeros(m * wide, dtype)
    place, bin_of = np.empty(n, np.int64), np.empty(n, np.int64)
    eights = 0
    for b in range(m):
        for d in range(m):
            bins[b * wide + d] = inst.bins[b, d]
        free = 0
        for j in range(n):
            to_bin[j * wide + b] = inst.to_bin[j, b]
            from_bin[j * wide + b] = inst.to_bin[j, b] + table.multipliers[j]
            if inst.home[j] == b:
                if free == 0:
                    bin_of[eights] = b
                    eights, free = eights + 1, LANES
                place[j] = eights * LANES - free
                free -= 1
    places = eights * LANES
    between = np.zeros((1 + n) * places, dtype)
    for i in range(n):
        between[place[i]] = inst.to_bin[i, inst.home[i]]
        for j in range(n):
            between[(1 + j) * places + place[i]] = min(inst.between[i, j], far) + table.multipliers[j]
    return Legs(to_bin, from_bin, bins, between, place, bin_of[:eights], far)


@kernel
def left_of(table: CostTable, row: int) -> NDArray[np.int64]:
    """Return how many objects of each group still have to be picked up in the state of a table row, shape (groups,)."""
    left = np.empty(table.size.size, np.int64)
    for g in range(left.size):
        left[g] = row % (table.size[g] + 1)
        row //= table.size[g] + 1
    return left


@kernel
def fill_rows(inst: Instance, table: CostTable, first: int, last: int) -> None:
    """Fill the table rows from `first` to `last` - 1. All previous rows must already be filled.

    Bins and the objects of each bin are processed eight at a time. The results of unused lanes are ignored.
    """
    n, m = inst.to_bin.shape
    wide, dtype, entries, width = lanes_for(m), table.entries.dtype, table.entries, table.width
    legs, left = legs_of(inst, table), left_of(table, first)
    picked, second = np.empty(n, np.int64), np.empty(n * wide, dtype)  # indices of objects, and values of W
    empty, carrying = np.empty(wide, dtype), np.empty(m * wide, dtype)  # values of E and V in a row
    holding = np.empty(legs.bin_of.size * LANES, dtype)  # values of Y in a row
    for row in range(first, last):
        second[:], empty[:], carrying[:] = legs.far, legs.far, legs.far
        count = 0
        for j in range(n):
            if left[table.group[j]] == 0:
                continue
            below = (row - table.stride[j]) * width
            at, own = below + 2 * m * inst.home[j], j * wide + inst.home[j]
            for d in range(0, wide, LANES):
                w = count * wide + d
                min_plus(second, w, entries, at + d, legs.to_bin, own)
                min_plus_each(second, w, entries, at + m + d, legs.to_bin, j * wide + d)
                min_plus(empty, d, legs.from_bin, j * wide + d, entries, below + 2 * m * m + j)
                for b in range(m):
                    min_plus(carrying, b * wide + d, second, w, legs.from_bin, j * wide + b)
            picked[count] = j
            count += 1
        if row == 0:
            empty[:] = 0
        for b in range(m):
            for d in range(0, wide, LANES):
                min_plus_each(carrying, b * wide + d, legs.bins, b * wide + d, empty, d)
            carrying[b * wide + b] = empty[b]
        _hold(legs, picked, count, second, empty, holding)
        start = row * width
        for b in range(m):
            for d in range(m):
                entries[start + 2 * m * b + d] = carrying[b * wide + d]
                entries[start + 2 * m * b + m + d] = carrying[d * wide + b]
        for i in range(n):
            entries[start + 2 * m * m + i] = holding[legs.place[i]]
        count_on(table, left)


@inlined
def _hold(
    legs: Legs, picked: NDArray[np.int64], count: int, second: Entries, empty: Entries, holding: Entries
) -> None:
    places, wide = holding.size, empty.size
    holding[:] = legs.far
    for eight in range(legs.bin_of.size):
        b, o = legs.bin_of[eight], eight * LANES
        min_plus(holding, o, legs.between, o, empty, b)
        for k in range(count):
            min_plus(holding, o, legs.between, (1 + picked[k]) * places + o, second, k * wide + b)


@inlined
def count_on(table: CostTable, left: NDArray[np.int64]) -> None:
    """Advance the numbers of remaining objects per group to the next table row."""
    for g in range(left.size):
        left[g] += 1
        if left[g] <= table.size[g]:
            break
        left[g] = 0
