"""Blocks of pixels compared and blended in whole numbers, sixteen pixels at once; see `lanes`.

Planes are padded and hold int16. What comes out is what pixel by pixel would: sums of whole numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from llvmlite import ir
from numba import types  # Numba as a whole first: half of it fails while another thread imports it
from numba.core import cgutils
from numba.extending import intrinsic

from mvcodec.kernels.lanes import (
    COUNT,
    SHORT,
    WORD,
    Lanes,
    constant,
    dot,
    filled,
    loaded,
    shuffled,
    store,
)
from mvcodec.kernels.prediction_runs import split
from mvcodec.kernels.runs import pointers

SMALL = 8
"""Pixels of a small window's side."""


def _total(lanes: Lanes) -> Any:
    """The sum of all lanes."""
    kind = lanes.value.type
    name = f"llvm.vector.reduce.add.v{kind.count}i{kind.element.width}"
    function = cgutils.get_or_insert_function(
        lanes.builder.module, ir.FunctionType(kind.element, [kind]), name
    )
    return lanes.builder.call(function, [lanes.value])


def _size(lanes: Lanes) -> Lanes:
    return lanes.where(lanes.is_(">", 0), lanes * -1)


def _sum(parts: Sequence[Lanes]) -> Lanes:
    total = parts[0]
    for part in parts[1:]:
        total += part
    return total


class _Rows:
    """Loads pixels side by side, so many rows below a place and so many to its right."""

    def __init__(self, builder: Any, plane: Any, place: Any, stride: Any) -> None:
        self._builder, self._plane, self._place, self._stride = builder, plane, place, stride

    def __call__(self, down: int, right: int = 0) -> Lanes:
        builder, kind = self._builder, self._place.type
        step = builder.mul(self._stride, ir.Constant(kind, down))
        at = builder.add(builder.add(self._place, step), ir.Constant(kind, right))
        return loaded(builder, self._plane, at, SHORT)


def _unlike(_typing, now, past, places, stride):  # type: ignore[no-untyped-def]
    """Sums of absolute differences of three windows of SMALL x SMALL pixels, four pixels apart.

    Args:
        now, past: int16, flat.
        places: two intp, the first pixel's in both.
        stride: intp, from row to row.

    Returns:
        three int32.
    """

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        planes = pointers(context, builder, signature, values, 2)
        one, other = (
            _Rows(builder, plane, place, values[3])
            for plane, place in zip(planes, split(builder, values[2], 2), strict=True)
        )
        apart = _sum([_size(one(row) - other(row)) for row in range(SMALL)])
        pairs = dot(apart, constant(builder, SHORT, [1] * COUNT))
        fours = shuffled(pairs, pairs, range(0, 8, 2)) + shuffled(pairs, pairs, range(1, 8, 2))
        sums = fours + shuffled(fours, fours, [1, 2, 3, 0])
        found = [builder.extract_element(sums.value, ir.Constant(WORD, lane)) for lane in range(3)]
        return context.make_tuple(builder, signature.return_type, found)

    return types.UniTuple(types.int32, 3)(now, past, places, stride), generate


def _slopes(_typing, now, past, places, stride, beyond):  # type: ignore[no-untyped-def]
    """Sums over COUNT x COUNT pixels; t is how much more, in 16ths, the past has at a place than now.

    Args:
        now, past, places, stride: as `unlike`.
        beyond: two int32, 0..15: how far (down, right) the past's place lies behind that, 16ths of a pixel.

    Returns:
        six int32: of |t|; of products of slopes, which are differences of pixels two apart: down with down,
        down with across, across with across; of t with the slope down, and with that across.
    """

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        planes = pointers(context, builder, signature, values, 2)
        own, other = (
            _Rows(builder, plane, place, values[3])
            for plane, place in zip(planes, split(builder, values[2], 2), strict=True)
        )
        down, right = (filled(builder, builder.trunc(part, SHORT)) for part in split(builder, values[4], 2))
        up, left = down * -1 + 16, right * -1 + 16
        lines = [other(row) * left + other(row, 1) * right for row in range(COUNT + 1)]
        ones = constant(builder, SHORT, [1] * COUNT)
        sums: list[list[Lanes]] = [[] for _ in range(6)]
        for row in range(COUNT):
            blended = lines[row] * up + lines[row + 1] * down + 8
            moved = Lanes(builder, builder.lshr(blended.value, blended.vector(4)))  # up to 65288: no sign
            t = moved - (own(row) << 4)
            vertical, horizontal = own(row + 1) - own(row - 1), own(row, 1) - own(row, -1)
            pairs = (
                (_size(t), ones),
                (vertical, vertical),
                (vertical, horizontal),
                (horizontal, horizontal),
                (vertical, t),
                (horizontal, t),
            )
            for sum_, pair in zip(sums, pairs, strict=True):
                sum_.append(dot(*pair))
        totals = [_total(_sum(each)) for each in sums]
        return context.make_tuple(builder, signature.return_type, totals)

    return types.UniTuple(types.int32, 6)(now, past, places, stride, beyond), generate


def _blend_block(_typing, now, past, luma, places, strides, across, along, share):  # type: ignore[no-untyped-def]
    """A block with its share of the past.

    Args:
        now, past: int16, flat.
        luma: uint8, flat, overwritten.
        places: three intp, the first pixel's in each.
        strides: two intp, from row to row: of the planes; of luma.
        across, along: four int32 each, taps in 128ths, the first one for the pixel before the past's place.
        share: three int32: the past's share of a quarter is as much in 64ths at most, and as much as its
            absolute differences lack to the second number, times the first one, shifted right by the third.

    Returns:
        four int32: the past's share of each quarter in 64ths, row by row.
    """

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        now, past, luma = pointers(context, builder, signature, values, 3)
        here, there, out = split(builder, values[3], 3)
        stride, step = split(builder, values[4], 2)
        own, other = _Rows(builder, now, here, stride), _Rows(builder, past, there, stride)
        across, along = ([filled(builder, tap) for tap in split(builder, values[n], 4)] for n in (5, 6))
        most, limit, shift = split(builder, values[7], 3)
        lines = [
            _sum(
                [other(row, right).to_words() * tap for right, tap in zip(range(-1, 3), across, strict=True)]
            )
            for row in range(-1, COUNT + 2)
        ]
        greys = [own(row).to_words() << 6 for row in range(COUNT)]
        apart = []
        for row in range(COUNT):
            fetched = _sum([line * tap for line, tap in zip(lines[row : row + 4], along, strict=True)])
            apart.append(((fetched + 128) >> 8) - greys[row])
        shares, half = [], COUNT // 2
        for first in (0, half):
            sizes = _sum([_size(each) for each in apart[first : first + half]])
            quarters = []
            for start in (0, half):
                lanes = shuffled(sizes, sizes, range(start, start + half))
                unlike = builder.ashr(_total(lanes), ir.Constant(WORD, 6))
                part = builder.ashr(builder.mul(builder.sub(limit, unlike), most), shift)
                one = filled(builder, part).within(0, filled(builder, most))
                quarters.append(one)
                shares.append(builder.extract_element(one.value, ir.Constant(WORD, 0)))
            share = shuffled(quarters[0], quarters[1], [*range(half), *range(COUNT, COUNT + half)])
            for row in range(first, first + half):
                value = greys[row] + ((share * apart[row] + 32) >> 6)
                at = builder.add(out, builder.mul(step, ir.Constant(step.type, row)))
                store(((value + 32) >> 6).within(0, 255).to_bytes(), luma, at)
        return context.make_tuple(builder, signature.return_type, shares)

    kinds = now, past, luma, places, strides, across, along, share
    return types.UniTuple(types.int32, 4)(*kinds), generate


def _blend_samples(_typing, now, past, chroma, places, strides, beyond, shares):  # type: ignore[no-untyped-def]
    """A block's chroma with its share of the past: eight by eight samples of one plane.

    Args:
        now, past: int16, flat.
        chroma: uint8, flat, overwritten.
        places: three intp, the first sample's in each.
        strides: two intp, from row to row: of the planes; of chroma.
        beyond: two int32, 0..15, as `slopes`.
        shares: four int32, of each quarter in 64ths, row by row.
    """

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        now, past, chroma = pointers(context, builder, signature, values, 3)
        here, there, out = split(builder, values[3], 3)
        stride, step = split(builder, values[4], 2)
        own, other = _Rows(builder, now, here, stride), _Rows(builder, past, there, stride)
        down, right = (filled(builder, part) for part in split(builder, values[5], 2))
        up, left = down * -1 + 16, right * -1 + 16
        four = [filled(builder, share) for share in split(builder, values[6], 4)]
        half, side = COUNT // 4, COUNT // 2
        order = [*range(half), *range(COUNT, COUNT + COUNT - half)]
        lines = [other(row).to_words() * left + other(row, 1).to_words() * right for row in range(side + 1)]
        for row in range(side):
            first = row // half * 2
            share = shuffled(four[first], four[first + 1], order)
            grey = own(row).to_words() << 6
            fetched = (lines[row] * up + lines[row + 1] * down + 2) >> 2
            value = grey + ((share * (fetched - grey) + 32) >> 6)
            found = ((value + 32) >> 6).to_bytes()
            at = builder.add(out, builder.mul(step, ir.Constant(step.type, row)))
            store(shuffled(found, found, range(side)), chroma, at)
        return context.get_dummy_value()

    kinds = now, past, chroma, places, strides, beyond, shares
    return types.void(*kinds), generate


unlike: Any = intrinsic(_unlike)
slopes: Any = intrinsic(_slopes)
blend_block: Any = intrinsic(_blend_block)
blend_samples: Any = intrinsic(_blend_samples)
