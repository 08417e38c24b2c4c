"""What the layered synthesizer sees of a run of pixels: cubic luma and linear colour; see `runs`."""

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
    store,
)
from mvcodec.kernels.runs import NOWHERE, fetch_early, places, pointers, rounds, store_channels
from mvcodec.kernels.view_fetch import CONTOUR
from mvcodec.kernels.view_vectors import LEVELS, ONE, STEPS

Fetch = Callable[..., Any]


def _split(place: Lanes, sharpness: Any) -> tuple[Lanes, ...]:
    """A place's pixel, and weights of the pixels around it: cubic, in two pairs, and linear."""
    whole = place.to_words()
    part = ((place - whole.to_floats()) * float(STEPS) + 0.5).to_words()
    return whole, *_cubic(part, filled(place.builder, sharpness)), _linear(part)


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
    """Of each two pairs the first numbers."""
    return (one & 0xFFFF) | (other << 16)


def _second_pair(one: Lanes, other: Lanes) -> Lanes:
    return ((one >> 16) & 0xFFFF) | (other & -0x10000)


def adding(luma: Fetch, differences: Fetch) -> Any:
    """The intrinsic that adds what a camera sees of sixteen pixels of a view's row, off its contours.

    Args:
        luma: writes the fetch of luma: ``luma(builder, plane, place, stride, across, along)``, the first two
            with the weights of a row's pixels and of a column's. In 1 / (LEVELS * ONE).
        differences: writes that of R - Y and B - Y.
    """

    def add(  # type: ignore[no-untyped-def]
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
            sums: flat float32, four numbers a pixel of the row: for each sixteen weighted Y, R - Y and B - Y,
                and the weights; added to.
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
                    grey = luma(builder, pairs, place, stride, across, along)
                    red, blue = differences(
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

    return intrinsic(add)


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
        reds, blues = _pair(one, other), _second_pair(one, other)
        lines.append([(dot(both, across) + ONE // 2) >> 14 for both in (reds, blues)])
    return [dot(_pair(above, below), along) for above, below in zip(*lines, strict=True)]


# A camera beside the view has its points in the same rows: of each column one pixel counts, with all of ONE.
# The same comes out as from the fetches above, at a third of their cost. So it is for one above the view.


def _luma_beside(builder, pairs, place, _stride, across, _along):  # type: ignore[no-untyped-def]
    """As `_luma` where a camera stands beside the view."""
    pixels = [
        loaded(builder, pairs, builder.add(place, ir.Constant(place.type, step)), WORD)
        for step in (-1, 0, 1, 2)
    ]
    return dot(_pair(*pixels[:2]), across[0]) + dot(_pair(*pixels[2:]), across[1])


def _differences_beside(builder, colour, place, _stride, across, _along):  # type: ignore[no-untyped-def]
    """As `_differences` where a camera stands beside the view."""
    one, other = (
        loaded(builder, colour, at, WORD) for at in (place, builder.add(place, ir.Constant(place.type, 1)))
    )
    return [(dot(both, across) + ONE // 2) & -ONE for both in (_pair(one, other), _second_pair(one, other))]


def _luma_above(builder, pairs, place, stride, _across, along):  # type: ignore[no-untyped-def]
    """As `_luma` where a camera stands above or below the view."""
    upper, lower = (
        dot(loaded(builder, pairs, line, WORD), weights)
        for line, weights in zip((builder.sub(place, stride), builder.add(place, stride)), along, strict=True)
    )
    return (upper + lower + ONE // 2) & -ONE


def _differences_above(builder, colour, place, stride, _across, along):  # type: ignore[no-untyped-def]
    """As `_differences` where a camera stands above or below the view."""
    above, below = (loaded(builder, colour, line, WORD) for line in (place, builder.add(place, stride)))
    return [dot(both, along) for both in (_pair(above, below), _second_pair(above, below))]


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


place_columns: Any = places(downwards=False, split=_split)
place_rows: Any = places(downwards=True, split=_split)
add_run: Any = adding(_luma, _differences)
add_run_beside: Any = adding(_luma_beside, _differences_beside)
add_run_above: Any = adding(_luma_above, _differences_above)
store_run: Any = intrinsic(_store_run)
