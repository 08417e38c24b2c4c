"""One pixel fetched in vector instructions, which Numba does not make of such short loops by itself.

It is written in LLVM's own vectors of four numbers, which become what the processor has: the same additions
and multiplications in the same order, and so the same results, everywhere.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types  # Numba as a whole first: half of it fails while another thread imports it
from numba.extending import intrinsic
from numpy.typing import NDArray

FOUR = ir.VectorType(ir.FloatType(), 4)
SHORT, WORD = ir.IntType(16), ir.IntType(32)
WORD_BYTES = 4
"""Loads begin at any float32."""

STEPS = 32
"""A fetch rounds where it is between two pixels to so many steps."""

PHASES = STEPS + 1
"""Both pixels count, so that rounding never makes another pair of them."""

LEVELS = 64
"""Steps of a grey level in planes of whole numbers."""

ONE = 1 << 14
"""What the weights of a fetch sum up to."""

SHARES = 24
"""Weights of one place: 4 x 4 of luma, then of the 2 x 2 pixels of colour, see `fetch_weights`."""


@cache
def fetch_weights(a: float) -> NDArray[np.int16]:
    """int16 (PHASES^2 * SHARES,), in 1 / ONE: what the pixels around each place between pixels count.

    Luma by cubic convolution (Keys 1981, equation 15, with its parameter a), the upper two rows and then the
    lower two, column by column; colour linearly: for each of the two columns its upper and its lower pixel,
    twice. Places are counted as `view_fetch.phase_of` does.
    """
    t = np.arange(PHASES) / STEPS
    cubes, squares = [a, a + 2, -(a + 2), -a], [-2 * a, -(a + 3), 2 * a + 3, a]
    cubic = np.stack([t**3, t**2, t, t**0], axis=1) @ np.array([cubes, squares, [a, 0, -a, 0], [0, 1, 0, 0]])
    linear = np.stack([1 - t, t], axis=1)
    luma = np.einsum("yhj,xi->yxhij", cubic.reshape(-1, 2, 2), cubic).reshape(-1, 16)
    colour = np.einsum("yj,xi->yxij", linear, linear).reshape(-1, 2, 1, 2).repeat(2, axis=2)
    whole = np.rint(luma * ONE).astype(np.int16)
    whole[np.arange(len(whole)), luma.argmax(axis=1)] += (ONE - whole.sum(axis=1)).astype(np.int16)
    return np.hstack([whole, np.rint(colour.reshape(-1, 8) * ONE).astype(np.int16)]).ravel()


LEAST_SHARE = ONE // 1000
"""Less of a pixel is not seen."""


def _address(builder, pointer, index):  # type: ignore[no-untyped-def]
    return builder.bitcast(builder.gep(pointer, [index]), FOUR.as_pointer())


def _load(builder, pointer, index):  # type: ignore[no-untyped-def]
    return builder.load(_address(builder, pointer, index), align=WORD_BYTES)


def _pick(builder, vector, *lanes, other=None):  # type: ignore[no-untyped-def]
    """Lanes 0..3 of a vector and 4..7 of the other one."""
    mask = ir.Constant(ir.VectorType(ir.IntType(32), len(lanes)), list(lanes))
    return builder.shuffle_vector(vector, ir.Constant(FOUR, ir.Undefined) if other is None else other, mask)


def fill(builder, number):  # type: ignore[no-untyped-def]
    """A number in all lanes."""
    one = builder.insert_element(ir.Constant(FOUR, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    return _pick(builder, one, 0, 0, 0, 0)


def add_product(builder, total, one, other):  # type: ignore[no-untyped-def]
    return builder.fadd(total, builder.fmul(one, other))


def _shorts(builder, pointer, index, count):  # type: ignore[no-untyped-def]
    kind = ir.VectorType(SHORT, count).as_pointer()
    return builder.load(builder.bitcast(builder.gep(pointer, [index]), kind), align=2)


def _shuffle(builder, one, other, lanes):  # type: ignore[no-untyped-def]
    mask = ir.Constant(ir.VectorType(WORD, len(lanes)), lanes)
    return builder.shuffle_vector(one, other, mask)


def _dot(builder, one, other):  # type: ignore[no-untyped-def]
    """Products of eight short numbers, added in pairs: what processors have one instruction for."""
    wide = ir.VectorType(WORD, 8)
    products = builder.mul(builder.sext(one, wide), builder.sext(other, wide))
    even, odd = (_shuffle(builder, products, products, list(range(first, 8, 2))) for first in (0, 1))
    return builder.add(even, odd)


def _luma(builder, plane, weights, share, place, stride):  # type: ignore[no-untyped-def]
    """Luma of the 4 x 4 window whose second pixel of the second row is `place`, in all lanes."""
    at = builder.sub(builder.sub(place, stride), ir.Constant(place.type, 1))
    rows = []
    for _ in range(4):
        rows.append(_shorts(builder, plane, at, 4))
        at = builder.add(at, stride)
    total = None
    for half in (0, 1):
        pixels = _shuffle(builder, rows[2 * half], rows[2 * half + 1], list(range(8)))
        at = builder.add(share, ir.Constant(share.type, 8 * half))
        product = _dot(builder, pixels, _shorts(builder, weights, at, 8))
        total = product if total is None else builder.add(total, product)
    return _sum(builder, total)


def _luma_of_pairs(builder, pairs, weights, share, place, stride):  # type: ignore[no-untyped-def]
    """The same from a plane of pairs, each pixel with the one below it, and weights in that order."""
    one = ir.Constant(place.type, 1)
    total = None
    for half, line in enumerate((builder.sub(place, stride), builder.add(place, stride))):
        pixels = _shorts(builder, pairs, builder.shl(builder.sub(line, one), one), 8)
        at = builder.add(share, ir.Constant(share.type, 8 * half))
        product = _dot(builder, pixels, _shorts(builder, weights, at, 8))
        total = product if total is None else builder.add(total, product)
    return _sum(builder, total)


def _sum(builder, vector):  # type: ignore[no-untyped-def]
    """The sum of four lanes, in all of them."""
    pairs = builder.add(vector, _shuffle(builder, vector, vector, [2, 3, 0, 1]))
    return builder.add(pairs, _shuffle(builder, pairs, pairs, [1, 0, 3, 2]))


def _colour(builder, plane, weights, share, place, stride):  # type: ignore[no-untyped-def]
    """(R - Y, B - Y) of the 2 x 2 window whose upper left pixel is `place`, twice."""
    two = ir.Constant(place.type, 2)
    top = _shorts(builder, plane, builder.mul(place, two), 4)
    low = _shorts(builder, plane, builder.mul(builder.add(place, stride), two), 4)
    pixels = _shuffle(builder, top, low, [0, 4, 1, 5, 2, 6, 3, 7])
    at = builder.add(share, ir.Constant(share.type, 16))
    columns = _dot(builder, pixels, _shorts(builder, weights, at, 8))
    return builder.add(columns, _shuffle(builder, columns, columns, [2, 3, 0, 1]))


def _add_fetched(_typing, pairs, colour, weights, sums, at, place, stride, phase, weight):  # type: ignore[no-untyped-def]
    """Add weight * (Y, R - Y, B - Y, 1) of one place between pixels to four of `sums` from index `at` on.

    Args:
        pairs, colour: flat int16 planes with borders, see `view_planes`; fetched cubic and linear.
        weights: see `fetch_weights`.
        sums: flat float32.
        at, place, stride: uintp; index into `sums`, of the pixel up left in the planes, and pixels of a row.
        phase: uintp, where between the pixels, see `view_fetch.phase_of`.
        weight: float32.
    """

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        pairs, colour, weights, sums = (
            context.make_array(kind)(context, builder, value).data
            for kind, value in zip(signature.args[:4], values[:4], strict=True)
        )
        at, place, stride, phase, weight = values[4:]
        share = builder.mul(phase, ir.Constant(phase.type, SHARES))
        grey = _luma_of_pairs(builder, pairs, weights, share, place, stride)
        differences = _colour(builder, colour, weights, share, place, stride)
        pixel = _shuffle(builder, grey, differences, [0, 4, 5, 0])
        unit = LEVELS * ONE
        pixel = builder.insert_element(pixel, ir.Constant(WORD, unit), ir.Constant(WORD, 3))
        factor = fill(builder, builder.fmul(weight, ir.Constant(ir.FloatType(), 1.0 / unit)))
        total = add_product(builder, _load(builder, sums, at), factor, builder.sitofp(pixel, FOUR))
        builder.store(total, _address(builder, sums, at), align=WORD_BYTES)
        return context.get_dummy_value()

    arguments = pairs, colour, weights, sums, at, place, stride, phase, weight
    return types.void(*arguments), generate


def _fetch_luma(_typing, plane, weights, place, stride, phase):  # type: ignore[no-untyped-def]
    """A value between pixels of a plane, times the sum of its weights: int32.

    Args:
        plane: flat int16 with a border.
        weights: flat int16, SHARES for each phase, as `fetch_weights` has them.
        place, stride, phase: uintp; of the pixel up left, pixels of a row, and which weights.
    """

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        pixels, shares = _pointers(context, builder, signature, values)
        share = builder.mul(values[4], ir.Constant(values[4].type, SHARES))
        total = _luma(builder, pixels, shares, share, values[2], values[3])
        return builder.extract_element(total, ir.Constant(WORD, 0))

    return types.int32(plane, weights, place, stride, phase), generate


def _fetch_colour(_typing, plane, weights, place, stride, phase):  # type: ignore[no-untyped-def]
    """Two values at once, as `fetch_luma`, linearly: the plane holds two numbers for each pixel."""

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        pixels, shares = _pointers(context, builder, signature, values)
        share = builder.mul(values[4], ir.Constant(values[4].type, SHARES))
        total = _colour(builder, pixels, shares, share, values[2], values[3])
        both = [builder.extract_element(total, ir.Constant(WORD, lane)) for lane in (0, 1)]
        return context.make_tuple(builder, signature.return_type, both)

    return types.UniTuple(types.int32, 2)(plane, weights, place, stride, phase), generate


def _pointers(context, builder, signature, values):  # type: ignore[no-untyped-def]
    """Those of the first two arguments, which are arrays."""
    return [
        context.make_array(kind)(context, builder, value).data
        for kind, value in zip(signature.args[:2], values[:2], strict=True)
    ]


def _add_edge(  # type: ignore[no-untyped-def]
    _typing, pairs, colour, own, weights, sums, at, place, stride, here, steps, phase, d, tolerance, weight
):
    """Add weight * (Y, R - Y, B - Y, 1) of one place to four of `sums`, as `add_fetched` does, but linear
    between those of the four pixels there that lie at disparity d, each by its share; 1 if there is any.

    Args:
        own: flat float32, the camera's map without border.
        here, steps: uintp; index into `own` of the pixel up left; (to the right one, to the lower one).
        d, tolerance, weight: float32.
    """

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        pairs, colour, own, weights, sums = (
            context.make_array(kind)(context, builder, value).data
            for kind, value in zip(signature.args[:5], values[:5], strict=True)
        )
        at, place, stride, here, steps, phase, d, tolerance, weight = values[5:]
        right, down = (builder.extract_value(steps, lane) for lane in (0, 1))
        words = ir.VectorType(WORD, 4)
        # Columns, each from above, as `fetch_weights` has them.
        depths: Any = ir.Constant(FOUR, ir.Undefined)
        for lane, step in enumerate((None, down, right, builder.add(right, down))):
            index = here if step is None else builder.add(here, step)
            depth = builder.load(builder.gep(own, [index]))
            depths = builder.insert_element(depths, depth, ir.Constant(WORD, lane))
        apart = builder.fsub(depths, fill(builder, d))
        far = builder.fcmp_ordered(">", apart, fill(builder, tolerance))
        low = builder.fcmp_ordered("<", apart, fill(builder, builder.fneg(tolerance)))
        share = builder.add(builder.mul(phase, ir.Constant(phase.type, SHARES)), ir.Constant(phase.type, 16))
        linear = _shorts(builder, weights, share, 8)
        linear = builder.sext(_shuffle(builder, linear, linear, [0, 1, 4, 5]), words)
        parts = builder.select(builder.or_(far, low), ir.Constant(words, [0] * 4), linear)
        below = builder.add(place, stride)
        two = ir.Constant(place.type, 2)
        grey = _shorts(builder, pairs, builder.mul(place, two), 4)
        above, under = (_shorts(builder, colour, builder.mul(row, two), 4) for row in (place, below))
        red, blue = (_shuffle(builder, above, under, lanes) for lanes in ([0, 4, 2, 6], [1, 5, 3, 7]))
        products = [builder.mul(parts, builder.sext(plane, words)) for plane in (grey, red, blue)] + [parts]
        (grey, red), (blue, whole) = products[:2], products[2:]
        left = builder.add(
            _shuffle(builder, grey, red, [0, 4, 1, 5]), _shuffle(builder, grey, red, [2, 6, 3, 7])
        )
        end = builder.add(
            _shuffle(builder, blue, whole, [0, 4, 1, 5]), _shuffle(builder, blue, whole, [2, 6, 3, 7])
        )
        pixel = builder.add(
            _shuffle(builder, left, end, [0, 1, 4, 5]), _shuffle(builder, left, end, [2, 3, 6, 7])
        )
        total = builder.extract_element(pixel, ir.Constant(WORD, 3))
        seen = builder.icmp_signed(">", total, ir.Constant(WORD, LEAST_SHARE))
        weight = builder.select(seen, weight, ir.Constant(ir.FloatType(), 0.0))
        unit = ir.Constant(FOUR, [1.0 / (LEVELS * ONE)] * 3 + [1.0 / ONE])
        factor = builder.fmul(fill(builder, weight), unit)
        total = add_product(builder, _load(builder, sums, at), factor, builder.sitofp(pixel, FOUR))
        builder.store(total, _address(builder, sums, at), align=WORD_BYTES)
        return builder.zext(seen, ir.IntType(8))

    arguments = pairs, colour, own, weights, sums, at, place, stride, here, steps, phase, d, tolerance, weight
    return types.uint8(*arguments), generate


add_fetched: Any = intrinsic(_add_fetched)
add_edge: Any = intrinsic(_add_edge)
fetch_luma: Any = intrinsic(_fetch_luma)
fetch_colour: Any = intrinsic(_fetch_colour)
