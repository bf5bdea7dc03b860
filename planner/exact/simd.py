"""Sums and minima of eight whole numbers at a time, inside kernels.

LLVM makes vector instructions of long loops, but not of loops over some six bins: written as plain loops, a table takes
2.4 times as long to fill. Nothing checks where an array ends.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

LANES = 8


def _min_plus(*, each: bool) -> Any:
    """Generate `out[o + l] = min(out[o + l], a[i + l] + b[k])` for the lanes l; with `each`, `b[k + l]`."""

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
