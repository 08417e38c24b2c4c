"""A run of pixels of a view fetched at once, from a camera whose pixels there lie side by side as well.

Disparity changes slowly off contours, so that neighbours in a view are neighbours in a camera too. Of sixteen
pixels all that are as far away from their places in the camera as the first one are fetched together, with
loads of neighbours only; what is left makes another round.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types  # Numba as a whole first: half of it fails while another thread imports it
from numba.core import cgutils
from numba.extending import intrinsic

from mvcodec.kernels.lanes import (
    BYTE,
    COUNT,
    FLOAT,
    WORD,
    Lanes,
    constant,
    dot,
    filled,
    loaded,
    shuffled,
    store,
)
from mvcodec.kernels.view_fetch import CONTOUR
from mvcodec.kernels.view_vectors import LEVELS, ONE, STEPS


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


def _split(place: Lanes, sharpness: Any) -> tuple[Lanes, ...]:
    """A place's pixel, and weights of the pixels around it: cubic, in two pairs, and linear."""
    whole = place.to_words()
    part = ((place - whole.to_floats()) * float(STEPS) + 0.5).to_words()
    return whole, *_cubic(part, filled(place.builder, sharpness)), _linear(part)


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
    lanes = Lanes(builder, builder.bitcast(now, among.value.type)) & apart.is_("==", filled(builder, offset))
    builder.store(builder.and_(now, builder.not_(lanes.bits())), left)
    work(offset, lanes)
    builder.branch(head)
    builder.position_at_end(end)


def _cubic(part: Lanes, a: Any) -> tuple[Lanes, Lanes]:
    """Weights of four pixels in a row around a place, in 1 / ONE, as pairs; see `view_vectors.fetch_weights`.

    With u = t (1 - t) they are a u (1 - t), 1 - t + u - (a + 2) u t, t - (a + 1) u + (a + 2) u t, a u t.
    """
    u = part * (part * -1 + STEPS)
    v = u * part
    au, av = (u * a + (STEPS**2 // 2)) >> 10, (v * a + (STEPS**3 // 2)) >> 15
    t, u = part * (ONE // STEPS), u << 4
    second = u - t + ONE - av - v
    third = t - au - u + av + v
    return _pair(au - av, second), _pair(third, av)


def _linear(part: Lanes) -> Lanes:
    """Weights of the two pixels around a place, in 1 / ONE, as a pair."""
    second = part * (ONE // STEPS)
    return _pair(second * -1 + ONE, second)


def _pair(one: Lanes, other: Lanes) -> Lanes:
    return (one & 0xFFFF) | (other << 16)


def _add_run(  # type: ignore[no-untyped-def]
    _typing,
    pairs,
    colour,
    fetchable,
    disparity,
    columns,
    rows,
    sums,
    seen,
    start,
    stride,
    x,
    column,
    row,
    weight,
    tolerance,
):
    """Add what a camera sees of sixteen pixels of a view's row, off its contours.

    Args:
        pairs, colour: flat int16 planes, see `view_planes`.
        fetchable: flat float32.
        disparity: float32, the view's row and COUNT - 1 numbers more.
        columns, rows: where the camera sees the pixels, see `place_columns` and `place_rows`.
        sums: flat float32, four numbers a pixel of the row: for each sixteen weighted Y, R - Y and B - Y, and
            the weights; added to.
        seen: uint8, one a pixel, added to.
        start: intp, index of the camera's first pixel in its planes.
        stride: intp, pixels of their rows.
        x: intp, the first pixel.
        column, row: intp, where its places begin in `columns` and `rows`.
        weight, tolerance: float32.

    Returns:
        uint32, which pixels lie at contours of the camera, the first lowest; nothing is added for them.
    """
    arguments = (
        pairs,
        colour,
        fetchable,
        disparity,
        columns,
        rows,
        sums,
        seen,
        start,
        stride,
        x,
        column,
        row,
        weight,
        tolerance,
    )

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        pairs, colour, fetchable, disparity, columns, rows, sums, seen = pointers(
            context, builder, signature, values, 8
        )
        start, stride, x, column, row, weight, tolerance = values[8:]
        index = start.type

        def of_place(array, first, number):  # type: ignore[no-untyped-def]
            return loaded(builder, array, builder.add(first, ir.Constant(index, COUNT * number)), WORD)

        d = loaded(builder, disparity, x, FLOAT)
        across, down = of_place(columns, column, 0), of_place(rows, row, 0)
        inside = across.is_(">", NOWHERE) & down.is_(">", NOWHERE)
        tolerance, weight = filled(builder, tolerance), filled(builder, weight)
        edges = cgutils.alloca_once_value(builder, ir.Constant(ir.IntType(COUNT), 0))

        def work(offset, lanes):  # type: ignore[no-untyped-def]
            place = builder.add(start, builder.sext(offset, index))
            here = loaded(builder, fetchable, place, FLOAT)
            later = builder.add(place, builder.shl(stride, ir.Constant(index, 2)))
            for plane in (pairs, colour, fetchable):
                fetch_early(builder, plane, later, WORD)
            at_contour = (lanes & here.is_("==", float(CONTOUR))).bits()
            builder.store(builder.or_(builder.load(edges), at_contour), edges)
            apart = here - d
            clear = lanes & apart.is_("<=", tolerance) & (apart + tolerance).is_(">=", 0.0)
            with builder.if_then(
                builder.icmp_unsigned("!=", clear.bits(), ir.Constant(ir.IntType(COUNT), 0))
            ):
                # Loaded here, since LLVM would widen them before the loop and narrow them in it again.
                across, along = (
                    [of_place(array, first, number) for number in (1, 2)] for array, first in both
                )
                grey = _luma(builder, pairs, place, stride, across, along)
                red, blue = _differences(
                    builder, colour, place, stride, *(of_place(array, first, 3) for array, first in both)
                )
                unit = weight * (1.0 / (LEVELS * ONE))
                for number, plane in enumerate((grey, red, blue, None)):
                    product = weight if plane is None else plane.to_floats() * unit
                    at = builder.add(
                        builder.shl(x, ir.Constant(index, 2)), ir.Constant(index, COUNT * number)
                    )
                    store(loaded(builder, sums, at, FLOAT) + product.where(clear, 0.0), sums, at)
                ones = Lanes(builder, builder.zext(clear.value, ir.VectorType(BYTE, COUNT)))
                store(loaded(builder, seen, x, BYTE) + ones, seen, x)

        both = (columns, column), (rows, row)
        rounds(builder, across + down, inside, work)
        return builder.zext(builder.load(edges), WORD)

    return types.uint32(*arguments), generate


def _luma(builder, pairs, place, stride, across, along):  # type: ignore[no-untyped-def]
    """Luma around places side by side, in 1 / (LEVELS * ONE): along columns, then across them."""
    columns = []
    above = builder.sub(place, stride)
    below = builder.add(place, stride)
    for step in (-1, 0, 1, 2):
        upper, lower = (
            dot(loaded(builder, pairs, builder.add(line, ir.Constant(line.type, step)), WORD), weights)
            for line, weights in zip((above, below), along, strict=True)
        )
        columns.append((upper + lower + ONE // 2) >> 14)
    halves = _pair(columns[0], columns[1]), _pair(columns[2], columns[3])
    return dot(halves[0], across[0]) + dot(halves[1], across[1])


def _differences(builder, colour, place, stride, across, along):  # type: ignore[no-untyped-def]
    """R - Y and B - Y at places side by side, in 1 / (LEVELS * ONE): along rows, then along columns."""
    lines = []
    for line in (place, builder.add(place, stride)):
        one, other = (
            loaded(builder, colour, at, WORD) for at in (line, builder.add(line, ir.Constant(line.type, 1)))
        )
        reds, blues = _pair(one, other), ((one >> 16) & 0xFFFF) | (other & -0x10000)
        lines.append([(dot(both, across) + ONE // 2) >> 14 for both in (reds, blues)])
    return [dot(_pair(above, below), along) for above, below in zip(*lines, strict=True)]


def _store_run(_typing, sums, first, pixels, place):  # type: ignore[no-untyped-def]
    """Store sixteen pixels as RGB, rounded and kept within 0..255; black where no weight is.

    Args:
        sums: see `add_run`.
        first: intp, index of the first of them.
        pixels: flat uint8.
        place: intp, index of the first byte.
    """

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        (sums,) = pointers(context, builder, signature, values, 1)
        pixels = context.make_array(signature.args[2])(context, builder, values[2]).data
        grey, red, blue, weight = (
            loaded(builder, sums, builder.add(values[1], ir.Constant(values[1].type, COUNT * number)), FLOAT)
            for number in range(4)
        )
        one = constant(builder, FLOAT, [1.0] * COUNT)
        scale = one / weight.where(weight.is_(">", 0.0), 1.0)
        grey, red, blue = grey * scale, red * scale, blue * scale
        green = grey + red * (-0.299 / 0.587) + blue * (-0.114 / 0.587)
        channels = [
            (channel + 0.5).within(0.0, 255.0).to_bytes() for channel in (grey + red, green, grey + blue)
        ]
        store_channels(channels, pixels, values[3])
        return context.get_dummy_value()

    return types.void(sums, first, pixels, place), generate


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


place_columns: Any = places(downwards=False, split=_split)
place_rows: Any = places(downwards=True, split=_split)
add_run: Any = intrinsic(_add_run)
store_run: Any = intrinsic(_store_run)
marked: Any = intrinsic(_marked)
first_of: Any = intrinsic(_first_of)
