"""What a camera shows of a run of a predicted picture's pixels, in whole numbers; see `runs`.

The same numbers come out as from fetching pixel by pixel: four taps down and four to the right are products
that are summed without rounding, so that their order is free.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types  # Numba as a whole first: half of it fails while another thread imports it
from numba.extending import intrinsic

from mvcodec.kernels.lanes import COUNT, SHORT, WORD, Lanes, constant, dot, filled, loaded, shuffled, store
from mvcodec.kernels.runs import NOWHERE, pointers, rounds

FINE_BITS = 6
FINE = 1 << FINE_BITS
"""Disparity and places are counted in these parts of a pixel."""

PHASES = 16
"""Steps of a fetch between two pixels."""

TAP_BITS = 7
"""Taps of one axis sum up to 128."""

MIDDLE = 128
"""Luma is stored less this: what taps make of it along one axis fits into 16 bits then."""

UNSEEN = -(1 << 31)
"""Stands for what a camera does not see; no fetch gives it."""

TOLERANCE = 96
"""Disparities that differ by no more are one surface, in FINE-ths."""

Fetch = Callable[..., Any]


def split(builder: Any, numbers: Any, count: int) -> list[Any]:
    """The numbers of a tuple."""
    return [builder.extract_value(numbers, number) for number in range(count)]


def _pair(one: Lanes, other: Lanes) -> Lanes:
    """Of each two pairs the first numbers."""
    return (one & 0xFFFF) | (other << 16)


def _second_pair(one: Lanes, other: Lanes) -> Lanes:
    return ((one >> 16) & 0xFFFF) | (other & -0x10000)


def _reader(builder: Any, address: Any, place: Any, stride: Any) -> Callable[[int, int], Lanes]:
    """Loads sixteen words of a plane, so many pixels to the right of a place and below it."""
    plane = builder.inttoptr(address, WORD.as_pointer())

    def load(right: int, down: int) -> Lanes:
        at = builder.add(place, ir.Constant(place.type, right))
        if down:
            at = builder.add(at, builder.mul(stride, ir.Constant(stride.type, down)))
        return loaded(builder, plane, at, WORD)

    return load


def _cubic(load: Callable[[int, int], Lanes], across: list[Lanes], along: list[Lanes]) -> Lanes:
    """Luma of places side by side, less MIDDLE: down the columns, then across them."""
    columns = [
        (dot(load(step, -1), along[0]) + dot(load(step, 1), along[1])) >> TAP_BITS for step in (-1, 0, 1, 2)
    ]
    return dot(_pair(*columns[:2]), across[0]) + dot(_pair(*columns[2:]), across[1])


def _cubic_beside(load: Callable[[int, int], Lanes], across: list[Lanes], _along: list[Lanes]) -> Lanes:
    """As `_cubic` where the camera stands in the view's row of cameras: one pixel of each column counts."""
    pixels = [load(step, 0) for step in (-1, 0, 1, 2)]
    return (dot(_pair(*pixels[:2]), across[0]) + dot(_pair(*pixels[2:]), across[1])) << TAP_BITS


def _cubic_above(load: Callable[[int, int], Lanes], _across: list[Lanes], along: list[Lanes]) -> Lanes:
    """As `_cubic` where the camera stands in the view's column."""
    return dot(load(0, -1), along[0]) + dot(load(0, 1), along[1])


def _linear(load: Callable[[int, int], Lanes], across: Lanes, along: Lanes) -> list[Lanes]:
    """Cb and Cr of places side by side: down columns, then across them."""
    columns = []
    for right in (0, 1):
        above, below = load(right, 0), load(right, 1)
        both = _pair(above, below), _second_pair(above, below)
        columns.append([dot(plane, along) >> TAP_BITS for plane in both])
    return [dot(_pair(one, other), across) for one, other in zip(*columns, strict=True)]


def _linear_beside(load: Callable[[int, int], Lanes], across: Lanes, _along: Lanes) -> list[Lanes]:
    one, other = load(0, 0), load(1, 0)
    return [dot(both, across) << TAP_BITS for both in (_pair(one, other), _second_pair(one, other))]


def _linear_above(load: Callable[[int, int], Lanes], _across: Lanes, along: Lanes) -> list[Lanes]:
    above, below = load(0, 0), load(0, 1)
    return [dot(both, along) for both in (_pair(above, below), _second_pair(above, below))]


def _looking(fetch: Fetch, beside: bool, above: bool) -> Any:
    """The intrinsic that fetches luma where a camera sees sixteen pixels of a row.

    Args:
        beside: the camera has them in the same row; above: in the same columns.
    """

    def look(_typing, disparity, columns, rows, out, x, camera, places):  # type: ignore[no-untyped-def]
        """Luma of sixteen pixels in 1 / 128^2, UNSEEN where the camera does not see them.

        Args:
            disparity: int32, the row's.
            columns, rows: flat int32, see `place_columns` and `place_rows`.
            out: int32, sixteen overwritten from index `x` (intp) on, the first pixel.
            camera: three intp: addresses of its first pixel and of that one's disparity in planes, see
                `prediction_planes`; pixels of their rows.
            places: four intp: index of the first pixel in planes; of what is said of it in `columns` and in
                `rows`; and from kind to kind there.
        """
        arguments = disparity, columns, rows, out, x, camera, places

        def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
            disparity, columns, rows, out = pointers(context, builder, signature, values, 4)
            x, (luma, own, stride) = values[4], split(builder, values[5], 3)
            start, column, row, room = split(builder, values[6], 4)

            def of_axis(array, first, number):  # type: ignore[no-untyped-def]
                step = builder.mul(room, ir.Constant(room.type, number))
                return loaded(builder, array, builder.add(first, step), WORD)

            d = loaded(builder, disparity, x, WORD)
            axes = [(columns, column)] * (not above) + [(rows, row)] * (not beside)
            parts = [of_axis(*axis, 0) for axis in axes]
            inside, apart = parts[0].is_(">", NOWHERE), parts[0]
            if len(parts) == 2:
                inside, apart = inside & parts[1].is_(">", NOWHERE), apart + parts[1]
            store(constant(builder, WORD, [UNSEEN] * COUNT), out, x)

            def work(offset, lanes):  # type: ignore[no-untyped-def]
                place = builder.add(start, builder.sext(offset, start.type))
                load = _reader(builder, own, place, stride)
                there = load(0, 0)
                if not above:
                    right = of_axis(columns, column, 1).is_("!=", 0)
                    there = load(1, 0).where(right, there)
                if not beside:
                    low = load(0, 1)
                    if not above:
                        low = load(1, 1).where(right, low)
                    there = low.where(of_axis(rows, row, 1).is_("!=", 0), there)
                difference = there - d
                clear = lanes & difference.is_("<=", TOLERANCE) & difference.is_(">=", -TOLERANCE)
                some = builder.icmp_unsigned("!=", clear.bits(), ir.Constant(ir.IntType(COUNT), 0))
                with builder.if_then(some):
                    # Loaded here, since LLVM would widen them before the loop and narrow them in it again;
                    # it does not where it stores in the loop.
                    across, along = (
                        [of_axis(array, first, number) for number in (2, 3)] if use else []
                        for array, first, use in ((columns, column, not above), (rows, row, not beside))
                    )
                    grey = fetch(_reader(builder, luma, place, stride), across, along)
                    grey += MIDDLE << 2 * TAP_BITS
                    store(grey.where(clear, loaded(builder, out, x, WORD)), out, x)

            rounds(builder, apart, inside, work)
            return context.get_dummy_value()

        return types.void(*arguments), generate

    return intrinsic(look)


def _tinting(fetch: Fetch, beside: bool, above: bool) -> Any:
    """The intrinsic that fetches chroma of sixteen samples of a row, as `_looking`."""

    def tint(_typing, seen, columns, rows, blue, red, x, camera, places):  # type: ignore[no-untyped-def]
        """Cb and Cr of sixteen samples in 1 / 128^2, UNSEEN where the camera does not see them.

        Args:
            seen: int32, what `look` has written for the row's pixels.
            columns, rows: flat int32, see `sample_columns` and `sample_rows`.
            blue, red: int32, sixteen overwritten from index `x` (intp) on, the first sample.
            camera: two intp: address of its first sample, see `prediction_planes`; samples of a row there.
            places: as `look` has them, for samples.
        """
        arguments = seen, columns, rows, blue, red, x, camera, places

        def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
            seen, columns, rows, *both = pointers(context, builder, signature, values, 5)
            x, (chroma, stride) = values[5], split(builder, values[6], 2)
            start, column, row, room = split(builder, values[7], 4)

            def of_axis(array, first, number):  # type: ignore[no-untyped-def]
                step = builder.mul(room, ir.Constant(room.type, number))
                return loaded(builder, array, builder.add(first, step), WORD)

            twice = builder.shl(x, ir.Constant(x.type, 1))
            first, second = (
                loaded(builder, seen, builder.add(twice, ir.Constant(x.type, begin)), WORD)
                for begin in (0, COUNT)
            )
            inside = shuffled(first, second, range(0, 2 * COUNT, 2)).is_("!=", UNSEEN)
            axes = [(columns, column)] * (not above) + [(rows, row)] * (not beside)
            parts = [of_axis(*axis, 0) for axis in axes]
            apart = parts[0] if len(parts) == 1 else parts[0] + parts[1]
            for out in both:
                store(constant(builder, WORD, [UNSEEN] * COUNT), out, x)

            def work(offset, lanes):  # type: ignore[no-untyped-def]
                place = builder.add(start, builder.sext(offset, start.type))
                across = None if above else of_axis(columns, column, 1)
                along = None if beside else of_axis(rows, row, 1)
                fetched = fetch(_reader(builder, chroma, place, stride), across, along)
                for plane, out in zip(fetched, both, strict=True):
                    store(plane.where(lanes, loaded(builder, out, x, WORD)), out, x)

            rounds(builder, apart, inside, work)
            return context.get_dummy_value()

        return types.void(*arguments), generate

    return intrinsic(tint)


def moved(disparity: Lanes, shift: Any, bits: int) -> Lanes:
    """What the shift makes of disparities, in FINE-ths of a sample, rounded."""
    builder, wide = disparity.builder, ir.VectorType(ir.IntType(64), COUNT)
    product = Lanes(builder, builder.sext(disparity.value, wide)) * filled(
        builder, builder.sext(shift, ir.IntType(64))
    )
    return Lanes(builder, builder.trunc(((product + (1 << (bits - 1))) >> bits).value, disparity.value.type))


def _cubic_taps(t: Lanes) -> list[Lanes]:
    """Four taps in 128ths at so many sixteenths, as FORMAT.md rounds them, in two pairs.

    With u = 16 - t they are Keys' polynomials in 320ths. All is 16 bits wide, and n * 205 >> 16 is n // 320
    for whatever comes; the third one's numerator is moved into their range and back.
    """
    builder = t.builder
    t = Lanes(builder, builder.trunc(t.value, ir.VectorType(SHORT, COUNT)))

    def rounded(numerator: Lanes) -> Lanes:
        wide = ir.VectorType(WORD, COUNT)
        product = Lanes(builder, builder.sext((numerator + 160).value, wide)) * 205
        return Lanes(builder, builder.trunc((product >> 16).value, t.value.type))

    u = t * -1 + 16
    both = t * u * -7
    first, last = rounded(both * u), rounded(both * t)
    third = rounded((u * 13 - 368) * u * u + 320 * 64) + (128 - 64)
    second = third * -1 - first - last + 128
    order = [lane + COUNT * half for lane in range(COUNT) for half in range(2)]
    return [shuffled(*pair, order).as_(WORD) for pair in ((first, second), (third, last))]


def _taps(pair: Lanes, downwards: bool) -> Lanes:
    """Two taps as they are stored: those down columns in 1 / 128^2, so that what they give is shifted once.

    Were it not, LLVM would find that half of the bits of what they give are used, and would use none of the
    instructions that add products.
    """
    return (pair.as_(SHORT) << TAP_BITS).as_(WORD) if downwards else pair


def _placing(downwards: bool) -> Any:
    """The intrinsic that finds where a camera sees pixels, down its columns or along its rows."""

    def place(_typing, disparity, out, x, to, axis):  # type: ignore[no-untyped-def]
        """Where a camera sees sixteen pixels of a row along one axis.

        Args:
            disparity: int32, the row's.
            out: flat int32, overwritten with sixteen numbers of each kind: how far in planes the pixel up
                left is from the view's own, NOWHERE outside of the picture; whether the next one is the
                nearest; the first two taps, and the others.
            x: intp, the first pixel.
            to: (intp, intp), index of the first kind in `out`, and from kind to kind.
            axis: four int32: the first pixel's place along the axis; pixels of the camera's picture along it;
                65536ths of a pixel for each of disparity; from one pixel to the next along it in planes.
        """

        def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
            disparity, out = pointers(context, builder, signature, values, 2)
            x, (at, room) = values[2], split(builder, values[3], 2)
            first, length, shift, step = split(builder, values[4], 4)
            way = moved(loaded(builder, disparity, x, WORD), shift, 16)
            nearest, fetched = (way + FINE // 2) >> FINE_BITS, way + 2
            corner = fetched >> FINE_BITS
            place = filled(builder, first) + nearest
            if not downwards:
                place += constant(builder, WORD, range(COUNT))
            inside = place.is_(">=", 0) & place.is_("<", filled(builder, length))
            offset = (corner * filled(builder, step)).where(inside, NOWHERE)
            taps = [_taps(pair, downwards) for pair in _cubic_taps((fetched >> 2) & (PHASES - 1))]
            for number, numbers in enumerate((offset, nearest - corner, *taps)):
                kind = builder.add(at, builder.mul(room, ir.Constant(room.type, number)))
                store(numbers, out, kind)
            return context.get_dummy_value()

        return types.void(disparity, out, x, to, axis), generate

    return intrinsic(place)


def _placing_samples(downwards: bool) -> Any:
    """As `_placing`, for samples of chroma."""

    def place(_typing, disparity, out, x, to, axis):  # type: ignore[no-untyped-def]
        """How far in planes the sample up left is from the view's own, and two taps; `axis`: the last two."""

        def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
            disparity, out = pointers(context, builder, signature, values, 2)
            x, (at, room), (shift, step) = (
                values[2],
                split(builder, values[3], 2),
                split(builder, values[4], 2),
            )
            fetched = moved(loaded(builder, disparity, x, WORD), shift, 17) + 2
            second = ((fetched >> 2) & (PHASES - 1)) * ((1 << TAP_BITS) // PHASES)
            store((fetched >> FINE_BITS) * filled(builder, step), out, at)
            pair = _pair(second * -1 + (1 << TAP_BITS), second)
            store(_taps(pair, downwards), out, builder.add(at, room))
            return context.get_dummy_value()

        return types.void(disparity, out, x, to, axis), generate

    return intrinsic(place)


place_columns: Any = _placing(downwards=False)
place_rows: Any = _placing(downwards=True)
sample_columns: Any = _placing_samples(downwards=False)
sample_rows: Any = _placing_samples(downwards=True)
look: Any = _looking(_cubic, beside=False, above=False)
look_beside: Any = _looking(_cubic_beside, beside=True, above=False)
look_above: Any = _looking(_cubic_above, beside=False, above=True)
tint: Any = _tinting(_linear, beside=False, above=False)
tint_beside: Any = _tinting(_linear_beside, beside=True, above=False)
tint_above: Any = _tinting(_linear_above, beside=False, above=True)
