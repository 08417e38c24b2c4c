"""Runs: pixels side by side that move to places side by side, so that sixteen are worked on together.

Disparity changes slowly off contours. Of sixteen neighbours in one picture all that are as far away from
their places in another one as the first of them make a run, with loads and stores of neighbours only; what is
left makes another round. What is written here is shared by the kernels of views.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types  # Numba as a whole first: half of it fails while another thread imports it
from numba.core import cgutils
from numba.extending import intrinsic

from mvcodec.kernels.lanes import BYTE, COUNT, FLOAT, WORD, Lanes, constant, filled, loaded, shuffled, store

PLACES = 4 * COUNT
"""Numbers that say where a camera sees sixteen pixels along one axis: whole pixels, and their weights."""

NOWHERE = -(1 << 30)
"""Stands for a place outside of the camera's picture; two of them make a number still."""


def places(downwards: bool, split: Callable[[Lanes, Any], tuple[Lanes, ...]]) -> Any:
    """The intrinsic that finds where pixels of a row are seen along one axis, and what is fetched there.

    Args:
        downwards: along columns of the camera; else along its rows.
        split: the whole pixel of each place, and numbers that say where beyond it, all of them to be stored.
    """

    def place(_typing, disparity, out, at, x, y, length, shift, step, sharpness):  # type: ignore[no-untyped-def]
        """Where a camera sees sixteen pixels of a view's row, along one axis.

        Args:
            disparity: float32, the view's row and COUNT - 1 numbers more; NaN is seen nowhere.
            out: int32, PLACES from index `at` (intp) on are overwritten.
            x, y: int32, the first pixel.
            length: int32, pixels of the camera's picture along this axis.
            shift: float32, px for each px of disparity.
            step: int32, from one pixel to the next along this axis, in pixels of planes.
            sharpness: int32, Keys' a in 1 / ONE.
        """
        arguments = disparity, out, at, x, y, length, shift, step, sharpness

        def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
            disparity, out = pointers(context, builder, signature, values, 2)
            at, x, y, length, shift, step, sharpness = values[2:]
            d = loaded(builder, disparity, builder.sext(x, at.type), FLOAT)
            lanes = [0 if downwards else lane for lane in range(COUNT)]
            first = filled(builder, builder.sitofp(y if downwards else x, FLOAT))
            place = first + constant(builder, FLOAT, lanes) + filled(builder, shift) * d
            end = filled(builder, builder.sitofp(length, FLOAT))
            inside = place.is_(">", -0.5) & place.is_("<", end - 0.5)
            whole, *parts = split(place.within(0.0, end - 1.0), sharpness)
            moved = whole * filled(builder, step) - constant(builder, WORD, lanes)
            for number, vector in enumerate((moved.where(inside, NOWHERE), *parts)):
                store(vector, out, builder.add(at, ir.Constant(at.type, COUNT * number)))
            return context.get_dummy_value()

        return types.void(*arguments), generate

    return intrinsic(place)


def lowest_bit(builder: Any, bits: Any) -> Any:
    """Number of the lowest bit that is set."""
    kind = ir.FunctionType(bits.type, [bits.type, ir.IntType(1)])
    function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.cttz.i{bits.type.width}")
    return builder.call(function, [bits, ir.Constant(ir.IntType(1), 1)])


def pointers(context: Any, builder: Any, signature: Any, values: Any, count: int) -> list[Any]:
    """Where the first arguments, which are arrays, have their elements."""
    return [
        context.make_array(kind)(context, builder, value).data
        for kind, value in zip(signature.args[:count], values[:count], strict=True)
    ]


def fetch_early(builder: Any, array: Any, index: Any, element: Any) -> None:
    """Ask for what lies at an index of an array before it is needed: a row later, as a rule."""
    byte = BYTE.as_pointer()
    kind = ir.FunctionType(ir.VoidType(), [byte, WORD, WORD, WORD])
    function = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
    address = builder.gep(builder.bitcast(array, element.as_pointer()), [index])
    builder.call(
        function, [builder.bitcast(address, byte), *(ir.Constant(WORD, number) for number in (0, 2, 1))]
    )


def rounds(builder: Any, apart: Lanes, among: Lanes, work: Any) -> None:
    """Write a loop over the distinct values of `apart` in the lanes `among`: ``work(value, which lanes)``."""
    # In the loop the offsets alone tell lanes apart: of bits LLVM makes a vector one bit after the other.
    apart = apart.where(among, NOWHERE)
    offsets = cgutils.alloca_once(builder, apart.value.type)
    builder.store(apart.value, offsets)
    left = cgutils.alloca_once_value(builder, among.bits())
    head, body, end = (builder.append_basic_block(name) for name in ("round", "run", "done"))
    builder.branch(head)
    builder.position_at_end(head)
    now = builder.load(left)
    builder.cbranch(builder.icmp_unsigned("!=", now, ir.Constant(now.type, 0)), body, end)
    builder.position_at_end(body)
    first = builder.zext(lowest_bit(builder, now), WORD)
    offset = builder.load(builder.gep(builder.bitcast(offsets, WORD.as_pointer()), [first]))
    lanes = apart.is_("==", filled(builder, offset))
    builder.store(builder.and_(now, builder.not_(lanes.bits())), left)
    work(offset, lanes)
    builder.branch(head)
    builder.position_at_end(end)


def store_channels(channels: list[Lanes], pixels: Any, place: Any) -> None:
    """Store sixteen pixels of three bytes."""
    red, green, blue = channels
    two = shuffled(red, green, range(2 * COUNT))
    third = shuffled(blue, blue, [*range(COUNT)] * 2)
    order = [pixel + COUNT * channel for pixel in range(COUNT) for channel in range(3)]
    store(shuffled(two, third, order), pixels, place)


def _marked(_typing, marks, start):  # type: ignore[no-untyped-def]
    """Which of sixteen bytes from an index on are not 0, the first lowest: uint32."""

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        (marks,) = pointers(context, builder, signature, values, 1)
        found = loaded(builder, marks, values[1], BYTE)
        bits = Lanes(builder, builder.icmp_unsigned("!=", found.value, found.vector(0))).bits()
        return builder.zext(bits, WORD)

    return types.uint32(marks, start), generate


def _first_of(_typing, bits):  # type: ignore[no-untyped-def]
    """Number of the lowest bit of a uint32 that is not 0."""

    def generate(_context, builder, _signature, values):  # type: ignore[no-untyped-def]
        return builder.zext(lowest_bit(builder, values[0]), ir.IntType(64))

    return types.intp(bits), generate


marked: Any = intrinsic(_marked)
first_of: Any = intrinsic(_first_of)
