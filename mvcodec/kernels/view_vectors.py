"""One pixel fetched in vector instructions, which Numba does not make of such short loops by itself.

It is written in LLVM's own vectors of four numbers, which become what the processor has: the same additions
and multiplications in the same order, and so the same results, everywhere.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic
from numpy.typing import NDArray

FOUR = ir.VectorType(ir.FloatType(), 4)
WORD_BYTES = 4
"""Loads begin at any float32."""


def cubic_polynomial(a: float) -> NDArray[np.float32]:
    """float32 (16,): the four weights of cubic convolution at fraction t, as factors of t^3, t^2, t and 1.

    Keys 1981, equation 15, with its parameter a.
    """
    cubes, squares = [a, a + 2, -(a + 2), -a], [-2 * a, -(a + 3), 2 * a + 3, a]
    return np.array([cubes, squares, [a, 0, -a, 0], [0, 1, 0, 0]], np.float32).ravel()


def _address(builder, pointer, index):  # type: ignore[no-untyped-def]
    return builder.bitcast(builder.gep(pointer, [index]), FOUR.as_pointer())


def _load(builder, pointer, index):  # type: ignore[no-untyped-def]
    return builder.load(_address(builder, pointer, index), align=WORD_BYTES)


def _pick(builder, vector, *lanes, other=None):  # type: ignore[no-untyped-def]
    """Lanes 0..3 of a vector and 4..7 of the other one."""
    mask = ir.Constant(ir.VectorType(ir.IntType(32), len(lanes)), list(lanes))
    return builder.shuffle_vector(vector, ir.Constant(FOUR, ir.Undefined) if other is None else other, mask)


def _fill(builder, number):  # type: ignore[no-untyped-def]
    """A number in all lanes."""
    one = builder.insert_element(ir.Constant(FOUR, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    return _pick(builder, one, 0, 0, 0, 0)


def _add_product(builder, total, one, other):  # type: ignore[no-untyped-def]
    return builder.fadd(total, builder.fmul(one, other))


def _weights(builder, polynomial, t):  # type: ignore[no-untyped-def]
    """The four weights of a cubic fetch at fraction t."""
    cubes, squares, lines, ones = (
        _load(builder, polynomial, ir.Constant(ir.IntType(64), 4 * power)) for power in range(4)
    )
    found = _add_product(builder, squares, cubes, t)
    return _add_product(builder, ones, _add_product(builder, lines, found, t), t)


def _cubic(builder, luma, polynomial, place, stride, t_x, t_y):  # type: ignore[no-untyped-def]
    """Luma of the 4 x 4 window whose second pixel of the second row is `place`, in all lanes."""
    across, down = _weights(builder, polynomial, t_x), _weights(builder, polynomial, t_y)
    at = builder.sub(builder.sub(place, stride), ir.Constant(place.type, 1))
    column = builder.fmul(_load(builder, luma, at), _pick(builder, down, 0, 0, 0, 0))
    for row in range(1, 4):
        at = builder.add(at, stride)
        column = _add_product(builder, column, _load(builder, luma, at), _pick(builder, down, *[row] * 4))
    products = builder.fmul(column, across)
    pairs = builder.fadd(products, _pick(builder, products, 2, 3, 0, 1))
    return builder.fadd(pairs, _pick(builder, pairs, 1, 0, 3, 2))


def _linear(builder, colour, place, stride, t_x, t_y):  # type: ignore[no-untyped-def]
    """(R - Y, B - Y) of the 2 x 2 window whose upper left pixel is `place`, twice."""
    two = ir.Constant(place.type, 2)
    top = _load(builder, colour, builder.mul(place, two))
    low = _load(builder, colour, builder.mul(builder.add(place, stride), two))
    between = _add_product(builder, top, builder.fsub(low, top), t_y)
    left, right = _pick(builder, between, 0, 1, 0, 1), _pick(builder, between, 2, 3, 2, 3)
    return _add_product(builder, left, builder.fsub(right, left), t_x)


def _add_fetched(_typing, luma, colour, polynomial, sums, at, place, stride, part_x, part_y, weight):  # type: ignore[no-untyped-def]
    """Add weight * (Y, R - Y, B - Y, 1) of one place between pixels to four of `sums` from index `at` on.

    Args:
        luma, colour: flat float32 planes with borders, see `view_planes`; fetched cubic and linear.
        polynomial: see `cubic_polynomial`.
        sums: flat float32.
        at, place, stride: uintp; index into `sums`, of the pixel up left in `luma`, and pixels of its rows.
        part_x, part_y: float32, how far right of and below that pixel, 0..1.
        weight: float32.
    """

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        planes = [
            context.make_array(kind)(context, builder, value).data
            for kind, value in zip(signature.args[:4], values[:4], strict=True)
        ]
        luma, colour, polynomial, sums = planes
        at, place, stride = values[4:7]
        t_x, t_y, weight = (_fill(builder, value) for value in values[7:])
        grey = _cubic(builder, luma, polynomial, place, stride, t_x, t_y)
        differences = _linear(builder, colour, place, stride, t_x, t_y)
        pixel = _pick(builder, grey, 0, 4, 5, 0, other=differences)
        one = ir.Constant(ir.FloatType(), 1.0)
        pixel = builder.insert_element(pixel, one, ir.Constant(ir.IntType(32), 3))
        total = _add_product(builder, _load(builder, sums, at), weight, pixel)
        builder.store(total, _address(builder, sums, at), align=WORD_BYTES)
        return context.get_dummy_value()

    arguments = luma, colour, polynomial, sums, at, place, stride, part_x, part_y, weight
    return types.void(*arguments), generate


add_fetched: Any = intrinsic(_add_fetched)
