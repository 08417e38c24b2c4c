"""Sixty-four bytes at once: values of kernels that are written in vectors where Numba would not find them.

LLVM turns them into what the processor has, of 16, 32 or 64 bytes, with the same results everywhere. Numbers
of 16 bits come as `widen` makes them, 64 of them too. All arrays are flat, and all indexes unsigned.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types  # Numba as a whole first: half of it fails while another thread imports it
from numba.core import cgutils
from numba.extending import intrinsic, models, register_model

LANES = 64


class _Bytes(types.Type):
    def __init__(self) -> None:
        super().__init__(name="mvcodec.Bytes")


class _Words(types.Type):
    def __init__(self) -> None:
        super().__init__(name="mvcodec.Words")


BYTES, WORDS = _Bytes(), _Words()
_LLVM = {BYTES: ir.VectorType(ir.IntType(8), LANES), WORDS: ir.VectorType(ir.IntType(16), LANES)}


class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: types.Type) -> None:
        super().__init__(manager, kind, _LLVM[kind])


register_model(_Bytes)(_Model)
register_model(_Words)(_Model)


def _address(context, builder, kind, place, vector):  # type: ignore[no-untyped-def]
    array, index = place
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [index]), _LLVM[vector].as_pointer())


def _element(array: Any) -> types.Type:
    return {8: BYTES, 16: WORDS}[array.dtype.bitwidth]


def _load(_typing, array, index):  # type: ignore[no-untyped-def]
    """64 numbers of an array, from this index on."""
    kind = _element(array)

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        address = _address(context, builder, signature.args[0], values, kind)
        return builder.load(address, align=array.dtype.bitwidth // 8)

    return kind(array, index), generate


def _store(_typing, array, index, vector):  # type: ignore[no-untyped-def]
    """64 numbers into an array, from this index on."""

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        address = _address(context, builder, signature.args[0], values[:2], vector)
        builder.store(values[2], address, align=array.dtype.bitwidth // 8)
        return context.get_dummy_value()

    return types.void(array, index, vector), generate


def _fill(_typing, value):  # type: ignore[no-untyped-def]
    """A uint8 in all lanes."""
    del value

    def generate(_context, builder, _signature, values):  # type: ignore[no-untyped-def]
        nothing = ir.Constant(_LLVM[BYTES], ir.Undefined)
        one = builder.insert_element(nothing, values[0], ir.Constant(ir.IntType(32), 0))
        lanes = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
        return builder.shuffle_vector(one, nothing, lanes)

    return BYTES(types.uint8), generate


def _widen(_typing, vector):  # type: ignore[no-untyped-def]
    """The same numbers in 16 bits each."""

    def generate(_context, builder, _signature, values):  # type: ignore[no-untyped-def]
        return builder.zext(values[0], _LLVM[WORDS])

    return WORDS(vector), generate


def _of_two(operate: Callable[[Any, Any, Any], Any], text: str) -> Any:
    """An operation on two vectors of one kind."""

    def made(_typing, one, other):  # type: ignore[no-untyped-def]
        del other

        def generate(_context, builder, _signature, values):  # type: ignore[no-untyped-def]
            return operate(builder, *values)

        return one(one, one), generate

    made.__doc__ = text
    return intrinsic(made)


def _named(name: str) -> Callable[..., Any]:
    """One of LLVM's own operations on vectors of bytes."""

    def operate(builder, *vectors):  # type: ignore[no-untyped-def]
        kinds = [vector.type for vector in vectors]
        kind = ir.FunctionType(kinds[0], kinds)
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}i8")
        return builder.call(function, vectors)

    return operate


def _mean(builder, one, other):  # type: ignore[no-untyped-def]
    wide = _LLVM[WORDS]
    total = builder.add(builder.zext(one, wide), builder.zext(other, wide))
    rounded = builder.add(total, ir.Constant(wide, [1] * LANES))
    return builder.trunc(builder.lshr(rounded, ir.Constant(wide, [1] * LANES)), one.type)


def _bits(_typing, vector):  # type: ignore[no-untyped-def]
    """How many bits of each byte are set."""

    def generate(_context, builder, _signature, values):  # type: ignore[no-untyped-def]
        return _named("ctpop")(builder, values[0])

    return vector(vector), generate


def _halved(_typing, vector):  # type: ignore[no-untyped-def]
    """Half of each number, rounded down."""

    def generate(_context, builder, _signature, values):  # type: ignore[no-untyped-def]
        return builder.lshr(values[0], ir.Constant(values[0].type, [1] * LANES))

    return vector(vector), generate


def _choose(_typing, one, other, where_equal, elsewhere):  # type: ignore[no-untyped-def]
    """Lanes of the third vector where the first two are equal, else of the fourth."""

    def generate(_context, builder, _signature, values):  # type: ignore[no-untyped-def]
        return builder.select(builder.icmp_unsigned("==", *values[:2]), *values[2:])

    return where_equal(one, other, where_equal, elsewhere), generate


def _select(sign: str) -> Callable[[Any, Any, Any], Any]:
    return lambda builder, one, other: builder.select(builder.icmp_unsigned(sign, one, other), one, other)


load: Any = intrinsic(_load)
store: Any = intrinsic(_store)
fill: Any = intrinsic(_fill)
widen: Any = intrinsic(_widen)
bits: Any = intrinsic(_bits)
halved: Any = intrinsic(_halved)
choose: Any = intrinsic(_choose)
least = _of_two(_select("<"), "The lesser of each two.")
most = _of_two(_select(">"), "The greater of each two.")
plus = _of_two(lambda builder, one, other: builder.add(one, other), "Sums; what is beyond is lost.")
minus = _of_two(lambda builder, one, other: builder.sub(one, other), "Differences of what is not less.")
times = _of_two(lambda builder, one, other: builder.mul(one, other), "Products; what is beyond is lost.")
differing = _of_two(lambda builder, one, other: builder.xor(one, other), "The bits that differ.")
plus_up_to_255 = _of_two(_named("uadd.sat"), "Sums of bytes, 255 at most.")
minus_down_to_0 = _of_two(_named("usub.sat"), "Differences of bytes, 0 at least.")
mean = _of_two(_mean, "Means of each two bytes, halves rounded up.")
