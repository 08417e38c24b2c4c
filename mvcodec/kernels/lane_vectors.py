"""One pixel of four lanes of 16 bits fetched and stored in vector instructions; see `view_vectors`."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types  # Numba as a whole first: half of it fails while another thread imports it
from numba.extending import intrinsic

from mvcodec.kernels.view_vectors import FOUR, SHORT, add_product, fill, store_bytes


def _add_lanes(_typing, packed, shares, lanes, at, place, stride, phase, weight):  # type: ignore[no-untyped-def]
    """Add weight * (red, green, blue, 1) of a place between pixels to `lanes[at]`, in whole numbers.

    Args:
        packed: flat uint64, four lanes of 16 bits a pixel.
        shares: uint16 (phases, 16), in 256ths, those of the upper two pixels four times each, then the lower.
        lanes: flat uint64.
        at, place, stride: uintp; index into `lanes`, of the pixel up left in `packed`, pixels of its rows.
        phase: uintp, row of `shares`.
        weight: uint64, below 2^16.
    """

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        packed, shares, lanes = (
            context.make_array(kind)(context, builder, value).data
            for kind, value in zip(signature.args[:3], values[:3], strict=True)
        )
        at, place, stride, phase, weight = values[3:]
        four, eight = ir.VectorType(SHORT, 4), ir.VectorType(SHORT, 8)

        def pixels(pointer, index, kind):  # type: ignore[no-untyped-def]
            return builder.bitcast(builder.gep(pointer, [index]), kind.as_pointer())

        row = builder.mul(phase, ir.Constant(phase.type, 16))
        total = None
        for step, half in ((None, 0), (stride, 8)):
            index = place if step is None else builder.add(place, step)
            share = builder.add(row, ir.Constant(row.type, half))
            product = builder.mul(
                builder.load(pixels(packed, index, eight), align=8),
                builder.load(pixels(shares, share, eight), align=2),
            )
            total = product if total is None else builder.add(total, product)
        none = ir.Constant(eight, ir.Undefined)
        left, right = (
            builder.shuffle_vector(total, none, ir.Constant(ir.VectorType(ir.IntType(32), 4), list(part)))
            for part in (range(4), range(4, 8))
        )
        summed = builder.add(builder.add(left, right), ir.Constant(four, [128] * 4))
        fetched = builder.lshr(summed, ir.Constant(four, [8] * 4))
        one = builder.insert_element(
            ir.Constant(four, ir.Undefined), builder.trunc(weight, SHORT), ir.Constant(ir.IntType(32), 0)
        )
        zero = ir.Constant(ir.VectorType(ir.IntType(32), 4), [0] * 4)
        factors = builder.shuffle_vector(one, ir.Constant(four, ir.Undefined), zero)
        where = pixels(lanes, at, four)
        builder.store(
            builder.add(builder.load(where, align=8), builder.mul(fetched, factors)), where, align=8
        )
        return context.get_dummy_value()

    return types.void(packed, shares, lanes, at, place, stride, phase, weight), generate


def _store_lanes(_typing, lanes, pixels, place):  # type: ignore[no-untyped-def]
    """Store as RGB what four lanes of 16 bits (uint64) hold, divided by the uppermost, rounded.

    Args:
        lanes: weighted sums of red, green and blue, and the sum of weights; 0 makes black.
        pixels: flat uint8, stored from index `place` (uintp) on.
    """

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        pixels = context.make_array(signature.args[1])(context, builder, values[1]).data
        lanes = builder.bitcast(values[0], ir.VectorType(ir.IntType(16), 4))
        numbers = builder.sitofp(builder.zext(lanes, ir.VectorType(ir.IntType(32), 4)), FOUR)
        weight = builder.extract_element(numbers, ir.Constant(ir.IntType(32), 3))
        one = ir.Constant(ir.FloatType(), 1.0)
        none = builder.fcmp_ordered("<", weight, one)
        scale = fill(builder, builder.fdiv(one, builder.select(none, one, weight)))
        rounded = add_product(builder, ir.Constant(FOUR, [0.5] * 4), numbers, scale)
        store_bytes(builder, rounded, pixels, values[2])
        return context.get_dummy_value()

    return types.void(lanes, pixels, place), generate


store_lanes: Any = intrinsic(_store_lanes)
add_lanes: Any = intrinsic(_add_lanes)
