"""Runs of sixteen pixels for the disparity of a predicted picture, in whole numbers; see `runs`."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types  # Numba as a whole first: half of it fails while another thread imports it
from numba.core import cgutils
from numba.extending import intrinsic

from mvcodec.kernels.lanes import COUNT, WORD, Lanes, constant, filled, loaded, store
from mvcodec.kernels.prediction_runs import FINE, FINE_BITS, moved, split
from mvcodec.kernels.runs import pointers, rounds

UNKNOWN = -(1 << 24)
"""Stands for a disparity that no camera knows; exact in float32, too, in which the median sorts it."""

REACH = 35
"""A moved pixel covers the places within this distance, in FINE-ths."""


def _move_run(_typing, disparity, out, x, at, size, shifts):  # type: ignore[no-untyped-def]
    """Move sixteen pixels of a map's row to a view, nearest surface last; see `prediction_depth.splat`.

    Args:
        disparity: int32, the row and COUNT - 1 numbers more, UNKNOWN.
        out: flat int32, the view with its border.
        x: intp, the first pixel.
        at: two int32: the first pixel's column and row.
        size: two int32: width and height of the map.
        shifts: two int32, 65536ths of a pixel that a pixel moves (left, up) for each of disparity.
    """

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        disparity, out = pointers(context, builder, signature, values, 2)
        width, height = split(builder, values[4], 2)
        d = loaded(builder, disparity, values[2], WORD)
        known = d.is_("!=", UNKNOWN)
        stride = filled(builder, builder.add(width, ir.Constant(WORD, 2 * COUNT)))
        lanes = constant(builder, WORD, range(COUNT))

        def along(first, shift, length):  # type: ignore[no-untyped-def]
            """The nearest pixel, and how far beyond its middle the place lies."""
            end = filled(builder, builder.shl(length, ir.Constant(WORD, FINE_BITS)))
            place = ((first << FINE_BITS) - moved(d, shift, 16)).within(-FINE, end)
            pixel = (place + FINE // 2) >> FINE_BITS
            return pixel, place - (pixel << FINE_BITS)

        (first, line), (by_x, by_y) = (split(builder, values[number], 2) for number in (3, 5))
        column, right = along(filled(builder, first) + lanes, by_x, width)
        row, down = along(filled(builder, line), by_y, height)
        apart = (row + 1) * stride + column + COUNT - lanes

        def work(offset, lanes):  # type: ignore[no-untyped-def]
            place = builder.sext(offset, ir.IntType(64))
            there = loaded(builder, out, place, WORD)
            store(d.where(lanes & d.is_(">", there), there), out, place)

        def some(lanes):  # type: ignore[no-untyped-def]
            return builder.if_then(
                builder.icmp_unsigned("!=", lanes.bits(), ir.Constant(ir.IntType(COUNT), 0))
            )

        one = constant(builder, WORD, [1] * COUNT)

        def covered_too(part):  # type: ignore[no-untyped-def]
            """Which neighbour is: -1, 1, 0 for none."""
            spill = FINE - REACH
            return one.where(part.is_(">=", spill)) - one.where(part.is_("<=", -spill))

        rounds(builder, apart, known, work)
        beside, above = covered_too(right), covered_too(down) * stride
        aside, over = beside.is_("!=", 0) & known, above.is_("!=", 0) & known
        with some(aside | over):  # one test: most pixels cover one place
            for step, also in ((beside, aside), (above, over), (beside + above, aside & over)):
                with some(also):
                    rounds(builder, apart + step, also, work)
        return context.get_dummy_value()

    return types.void(disparity, out, x, at, size, shifts), generate


def _mean_run(_typing, said, weights, out, places, x, tolerance):  # type: ignore[no-untyped-def]
    """Means of what cameras say of sixteen pixels, each by its weight, rounded down; UNKNOWN where none does.

    Args:
        said: flat int32, disparities by camera.
        weights: float64 (N,), of the cameras, whole numbers.
        out: float32, overwritten from index `x` (intp) on.
        places: two intp: index of the first pixel as the first camera says it; from camera to camera.
        tolerance: int32.

    Returns:
        uint32, where the nearest and the farthest are more than `tolerance` apart, the first pixel lowest.
    """

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        said, weights, out = pointers(context, builder, signature, values, 3)
        (place, step), x, tolerance = split(builder, values[3], 2), values[4], values[5]
        count = context.make_array(signature.args[1])(context, builder, values[1])
        count = builder.extract_value(count.shape, 0)
        double, wide = ir.DoubleType(), ir.VectorType(ir.DoubleType(), COUNT)
        nothing = constant(builder, double, [0.0] * COUNT)
        low, high = (constant(builder, WORD, [end] * COUNT) for end in (UNKNOWN, -UNKNOWN))
        totals = [cgutils.alloca_once(builder, each.value.type) for each in (nothing, nothing, low, high)]
        for each, start in zip(totals, (nothing, nothing, low, high), strict=True):
            builder.store(start.value, each)
        with cgutils.for_range(builder, count) as loop:
            sums, total, nearest, farthest = (Lanes(builder, builder.load(each)) for each in totals)
            d = loaded(builder, said, builder.add(place, builder.mul(loop.index, step)), WORD)
            known = d.is_(">", UNKNOWN)
            weight = filled(builder, builder.load(builder.gep(weights, [loop.index])))
            part = Lanes(builder, builder.select(known.value, weight.value, nothing.value))
            product = builder.fmul(part.value, builder.sitofp(d.value, wide))
            added = (
                Lanes(builder, builder.fadd(sums.value, product)),
                Lanes(builder, builder.fadd(total.value, part.value)),
                d.where(d.is_(">", nearest), nearest),
                d.where(d.is_("<", farthest) & known, farthest),
            )
            for each, lanes in zip(totals, added, strict=True):
                builder.store(lanes.value, each)
        sums, total, nearest, farthest = (Lanes(builder, builder.load(each)) for each in totals)
        some = nearest.is_(">", UNKNOWN)
        divisor = builder.select(some.value, total.value, ir.Constant(wide, [1.0] * COUNT))
        floor = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(wide, [wide]), f"llvm.floor.v{COUNT}f64"
        )
        mean = builder.call(floor, [builder.fdiv(sums.value, divisor)])
        mean = Lanes(builder, builder.fptrunc(mean, ir.VectorType(ir.FloatType(), COUNT)))
        store(mean.where(some, float(UNKNOWN)), out, x)
        apart = nearest - farthest
        return builder.zext((apart.is_(">", filled(builder, tolerance)) & some).bits(), WORD)

    return types.uint32(said, weights, out, places, x, tolerance), generate


move_run: Any = intrinsic(_move_run)
mean_run: Any = intrinsic(_mean_run)
