"""What the quick synthesizer sees of a run of pixels: linear, in whole numbers; see `runs`."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types  # Numba as a whole first: half of it fails while another thread imports it
from numba.extending import intrinsic

from mvcodec.kernels.lanes import (
    BYTE,
    COUNT,
    FLOAT,
    SHORT,
    WORD,
    Lanes,
    constant,
    filled,
    loaded,
    shuffled,
    store,
)
from mvcodec.kernels.runs import NOWHERE, fetch_early, places, pointers, rounds, store_channels

BITS = 4
STEPS = 1 << BITS
"""Places between two pixels that a fetch tells apart. The products of both axes fill a number of 16 bits."""

CHANNELS = 4
"""Bytes of a pixel: red, green, blue, and 1, which comes out as the sum of the weights."""


def _split(place: Lanes, _sharpness: Any) -> tuple[Lanes, ...]:
    """A place's pixel, steps beyond it, and these once more for each channel of 16 bits, in two halves."""
    fine = (place * float(STEPS) + 0.5).to_words()
    part = fine & (STEPS - 1)
    twice = part | (part << 16)
    halves = [
        shuffled(twice, twice, [first + lane // 2 for lane in range(COUNT)]) for first in (0, COUNT // 2)
    ]
    return fine >> BITS, part, *halves


def _add_run(  # type: ignore[no-untyped-def]
    _typing,
    packed,
    own,
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
    """Add what a camera sees of sixteen pixels of a view's row, by its weight.

    Args:
        packed: flat uint32, pixels of CHANNELS bytes, see `view_quick.pack`.
        own: flat float32, the camera's map, laid out alike.
        disparity: float32, the view's row and COUNT - 1 numbers more.
        columns, rows: where the camera sees the pixels, see `place_columns` and `place_rows`.
        sums: uint64, one a pixel of the row: CHANNELS sums of 16 bits; added to.
        seen: uint8, one a pixel, added to.
        start: intp, index of the camera's first pixel.
        stride: intp, pixels of a row of `packed`.
        x: intp, the first pixel.
        column, row: intp, where its places begin in `columns` and `rows`.
        weight: uint64, below 2^16.
        tolerance: float32.
    """
    arguments = (
        packed, own, disparity, columns, rows, sums, seen, start, stride, x, column, row, weight, tolerance,
    )  # fmt: skip

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        packed, own, disparity, columns, rows, sums, seen = pointers(context, builder, signature, values, 7)
        start, stride, x, column, row, weight, tolerance = values[7:]
        index = start.type

        def number(value):  # type: ignore[no-untyped-def]
            return ir.Constant(index, value)

        def of_place(array, first, which):  # type: ignore[no-untyped-def]
            return loaded(builder, array, builder.add(first, number(COUNT * which)), WORD)

        d = loaded(builder, disparity, x, FLOAT)
        across, down = of_place(columns, column, 0), of_place(rows, row, 0)
        inside = across.is_(">", NOWHERE) & down.is_(">", NOWHERE)
        right, low = (
            of_place(array, first, 1).is_(">=", STEPS // 2)
            for array, first in ((columns, column), (rows, row))
        )
        tolerance = filled(builder, tolerance)
        factor = filled(builder, builder.trunc(weight, SHORT), 2 * COUNT)

        def work(offset, lanes):  # type: ignore[no-untyped-def]
            place = builder.add(start, builder.sext(offset, index))
            below = builder.add(place, stride)
            corners = [builder.add(at, number(step)) for at in (place, below) for step in (0, 1)]
            later = builder.add(place, builder.shl(stride, number(2)))
            for plane in (packed, own):
                fetch_early(builder, plane, later, WORD)
            depths = [loaded(builder, own, at, FLOAT) for at in corners]
            upper, lower = (depths[2 * half + 1].where(right, depths[2 * half]) for half in (0, 1))
            apart = lower.where(low, upper) - d
            clear = lanes & apart.is_("<=", tolerance) & (apart + tolerance).is_(">=", 0.0)
            with builder.if_then(
                builder.icmp_unsigned("!=", clear.bits(), ir.Constant(ir.IntType(COUNT), 0))
            ):
                pixels = [loaded(builder, packed, at, WORD).as_(BYTE) for at in corners]
                for half in (0, 1):
                    part_x, part_y = (
                        of_place(array, first, 2 + half).as_(SHORT)
                        for array, first in ((columns, column), (rows, row))
                    )
                    _add_half(half, pixels, part_x, part_y, factor, clear, sums, x)
                ones = Lanes(builder, builder.zext(clear.value, ir.VectorType(BYTE, COUNT)))
                store(loaded(builder, seen, x, BYTE) + ones, seen, x)

        rounds(builder, across + down, inside, work)
        return context.get_dummy_value()

    return types.void(*arguments), generate


def _add_half(half, pixels, part_x, part_y, factor, clear, sums, x):  # type: ignore[no-untyped-def]
    """Add eight pixels of a run, the first or the last, from those around them."""
    builder, size = clear.builder, CHANNELS * COUNT // 2
    lanes = range(size * half, size * (half + 1))
    upper_left, upper_right, lower_left, lower_right = (
        shuffled(pixel, pixel, lanes).widened() for pixel in pixels
    )
    upper = (upper_left << BITS) + (upper_right - upper_left) * part_x
    lower = (lower_left << BITS) + (lower_right - lower_left) * part_x
    fetched = (((upper << BITS) + (lower - upper) * part_y + STEPS**2 // 2) >> 2 * BITS) & 0xFF
    pixel = ir.IntType(16 * CHANNELS)
    product = (fetched * factor).as_(pixel)
    first = COUNT // 2 * half
    seen = shuffled(clear, clear, range(first, first + COUNT // 2))
    at = builder.add(x, ir.Constant(x.type, first))
    store(loaded(builder, sums, at, pixel, COUNT // 2) + product.where(seen), sums, at)


def _store_run(_typing, sums, first, pixels, place):  # type: ignore[no-untyped-def]
    """Store sixteen pixels as RGB: their sums divided by the last of them, rounded; black where that is 0.

    Args:
        sums: see `add_run`.
        first: intp, index of the first of them.
        pixels: flat uint8.
        place: intp, index of the first byte.
    """

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        sums, pixels = (
            context.make_array(kind)(context, builder, value).data
            for kind, value in zip(signature.args[::2], values[::2], strict=True)
        )
        pixel = ir.IntType(16 * CHANNELS)
        low, high = [
            loaded(
                builder, sums, builder.add(values[1], ir.Constant(values[1].type, start)), pixel, COUNT // 2
            ).as_(SHORT)
            for start in (0, COUNT // 2)
        ]
        *channels, weight = (
            (shuffled(low, high, range(channel, CHANNELS * COUNT, CHANNELS)).to_words() & 0xFFFF).to_floats()
            for channel in range(CHANNELS)
        )
        scale = constant(builder, FLOAT, [1.0] * COUNT) / weight.where(weight.is_(">", 0.0), 1.0)
        store_channels([(channel * scale + 0.5).to_bytes() for channel in channels], pixels, values[3])
        return context.get_dummy_value()

    return types.void(sums, first, pixels, place), generate


place_columns: Any = places(downwards=False, split=_split)
place_rows: Any = places(downwards=True, split=_split)
add_run: Any = intrinsic(_add_run)
store_run: Any = intrinsic(_store_run)
