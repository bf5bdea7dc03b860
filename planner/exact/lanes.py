"""Eight whole numbers at a time, for kernels: what the processor adds and compares in one or two instructions.

numba makes such instructions of long loops, but not of short ones that write what they work out, like those over bins.
The functions here work on flat arrays of whole numbers, inside kernels only. None checks where an array ends: eight
numbers are read or written from an index on.
"""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.datamodel.models import PrimitiveModel
from numba.extending import intrinsic, register_model

LANES = 8

Signature = tuple[Any, Callable[..., Any]]  # types of a function, and what writes its instructions


def in_kernels(function: Callable[..., Signature]) -> Any:
    """A function for kernels, from one that says by what instructions it is compiled, given types of arguments."""
    return intrinsic(function)


class Lanes(types.Type):  # type: ignore[misc]
    """The type of eight whole numbers of so many bits."""

    def __init__(self, bits: int) -> None:
        super().__init__(f"Lanes({bits})")
        self.bits = bits


@register_model(Lanes)
class _LanesModel(PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, lanes: Lanes) -> None:
        super().__init__(manager, lanes, _vector(lanes.bits))


@in_kernels
def load(_: Any, array: Any, _index: Any) -> Signature:
    """Eight numbers of an array from an index on."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointer, size = _pointer(context, builder, signature, arguments)
        return builder.load(pointer, align=size)

    return Lanes(array.dtype.bitwidth)(array, types.intp), generate


@in_kernels
def store(_: Any, array: Any, _index: Any, lanes: Any) -> Signature:
    """Write eight numbers into an array from an index on."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointer, size = _pointer(context, builder, signature, arguments)
        builder.store(arguments[2], pointer, align=size)
        return context.get_dummy_value()

    return types.void(array, types.intp, lanes), generate


@in_kernels
def repeat(_: Any, array: Any, _index: Any) -> Signature:
    """Eight times the number of an array at an index."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = signature.args[0]
        numbers = context.make_array(kind)(context, builder, arguments[0])
        vector, whole = _vector(kind.dtype.bitwidth), ir.IntType(32)
        nothing = ir.Constant(vector, ir.Undefined)
        number = builder.load(builder.gep(numbers.data, [arguments[1]]))
        first = builder.insert_element(nothing, number, ir.Constant(whole, 0))
        return builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(whole, LANES), [0] * LANES))

    return Lanes(array.dtype.bitwidth)(array, types.intp), generate


@in_kernels
def copy(_: Any, to: Any, _at: Any, source: Any, _index: Any) -> Signature:
    """Write the number of an array at an index into another array."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        into = context.make_array(signature.args[0])(context, builder, arguments[0])
        numbers = context.make_array(signature.args[2])(context, builder, arguments[2])
        number = builder.load(builder.gep(numbers.data, [arguments[3]]))
        builder.store(number, builder.gep(into.data, [arguments[1]]))
        return context.get_dummy_value()

    return types.void(to, types.intp, source, types.intp), generate


@in_kernels
def plus(_: Any, one: Any, other: Any) -> Signature:
    """Eight sums."""

    def generate(_: Any, builder: Any, __: Any, arguments: Any) -> Any:
        return builder.add(*arguments)

    return one(one, other), generate


@in_kernels
def least(_: Any, one: Any, other: Any) -> Signature:
    """The lesser of two numbers, eight times."""

    def generate(_: Any, builder: Any, __: Any, arguments: Any) -> Any:
        return builder.select(builder.icmp_signed("<", *arguments), *arguments)

    return one(one, other), generate


@in_kernels
def lowest(_: Any, _bits: Any) -> Signature:
    """Number of the lowest bit that is set, of one that is not 0."""

    def generate(_: Any, builder: Any, __: Any, arguments: Any) -> Any:
        return builder.cttz(arguments[0], ir.Constant(ir.IntType(1), 1))

    return types.int64(types.int64), generate


def _vector(bits: int) -> Any:
    return ir.VectorType(ir.IntType(bits), LANES)


def _pointer(context: Any, builder: Any, signature: Any, arguments: Any) -> tuple[Any, int]:
    """Pointer to eight numbers of an array, and the size of each, bytes."""
    kind = signature.args[0]
    array = context.make_array(kind)(context, builder, arguments[0])
    pointer = builder.gep(array.data, [arguments[1]])
    return builder.bitcast(pointer, _vector(kind.dtype.bitwidth).as_pointer()), kind.dtype.bitwidth // 8
