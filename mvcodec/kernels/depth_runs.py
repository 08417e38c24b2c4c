"""Runs of sixteen pixels for disparity at a view: moved there together, and averaged where cameras agree."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types  # Numba as a whole first: half of it fails while another thread imports it
from numba.core import cgutils
from numba.extending import intrinsic

from mvcodec.kernels.lanes import COUNT, FLOAT, WORD, Lanes, constant, filled, loaded, store
from mvcodec.kernels.runs import pointers, rounds

UNKNOWN = -1e9
"""Stands for a disparity that no camera knows; below any real one."""


def _move_run(_typing, disparity, out, start, x, y, width, height, shift_x, shift_y, spill, rows):  # type: ignore[no-untyped-def]
    """Move sixteen pixels of a map's row to a view, nearest surface last; see `view_depth.splat`.

    Args:
        disparity: float32, the row from its first pixel on and COUNT - 1 numbers more, NaN.
        out: flat float32, rows of the view with its border.
        start: intp, index of their first number.
        x, y: int32, the first pixel.
        width, height: int32, of the map.
        shift_x, shift_y: float32, px that a pixel moves (left, up) for each px of disparity.
        spill: float32, px beyond a pixel's middle from which on its neighbour is covered too.
        rows: three int32: the first and the last row of the view, counted with its border, that are written
            to; and the bits of such a row's number that say which row of `out` it is.
    """
    arguments = disparity, out, start, x, y, width, height, shift_x, shift_y, spill, rows

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        disparity, out = pointers(context, builder, signature, values, 2)
        start, x, y, width, height, shift_x, shift_y, spill, rows = values[2:]
        least, most, bits = (filled(builder, builder.extract_value(rows, number)) for number in range(3))
        index = ir.IntType(64)
        d = loaded(builder, disparity, builder.sext(x, index), FLOAT)
        known = d.is_("==", d)
        stride = builder.add(width, ir.Constant(WORD, 2 * COUNT))
        lanes = constant(builder, FLOAT, range(COUNT))
        spill = filled(builder, spill)

        def along(first, shift, length):  # type: ignore[no-untyped-def]
            """The nearest pixel, 0 in the border, and how far beyond its middle the place lies."""
            target = first - filled(builder, shift) * d
            target = target.within(-1.0, filled(builder, builder.sitofp(length, FLOAT)))
            pixel = (target + 1.5).to_words()
            return pixel, target + 1.0 - pixel.to_floats()

        def there_of(row, column):  # type: ignore[no-untyped-def]
            """How far from their places the pixels land, and which of them are written."""
            return (row & bits) * filled(builder, stride) + column, row.is_(">=", least) & row.is_("<=", most)

        def work(offset, lanes):  # type: ignore[no-untyped-def]
            place, said = builder.add(start, builder.sext(offset, index)), d.where(lanes, UNKNOWN)
            there = loaded(builder, out, place, FLOAT)
            store(there.most(said), out, place)

        def some(lanes):  # type: ignore[no-untyped-def]
            return builder.if_then(
                builder.icmp_unsigned("!=", lanes.bits(), ir.Constant(ir.IntType(COUNT), 0))
            )

        one = constant(builder, WORD, [1] * COUNT)

        def covered_too(part):  # type: ignore[no-untyped-def]
            """Which neighbour is: -1, 1, 0 for none."""
            return one.where(part.is_(">=", spill)) - one.where((part * -1.0).is_(">=", spill))

        def move(row, down):  # type: ignore[no-untyped-def]
            column, right = along(filled(builder, builder.sitofp(x, FLOAT)) + lanes, shift_x, width)
            column = column + COUNT - 1 - constant(builder, WORD, range(COUNT))
            apart, written = there_of(row, column)
            rounds(builder, apart, known & written, work)
            # One test: most pixels cover one place.
            with some(right.size().most(down.size()).is_(">=", spill)):
                beside, above = covered_too(right), covered_too(down)
                aside, over = beside.is_("!=", 0) & known, above.is_("!=", 0) & known
                others = (row, column + beside, aside), (row + above, column, over)
                for to_row, to_column, also in (*others, (row + above, column + beside, aside & over)):
                    apart, written = there_of(to_row, to_column)
                    with some(also & written):
                        rounds(builder, apart, also & written, work)

        row, down = along(filled(builder, builder.sitofp(y, FLOAT)), shift_y, height)
        # Of a row that is moved for the sake of few of its pixels most sixteens end here.
        within = row.is_(">=", least - 1) & row.is_("<=", most + 1)
        with some(known & within):
            move(row, down)
        return context.get_dummy_value()

    return types.void(*arguments), generate


def _vote_run(_typing, moved, weights, out, place, step, at, tolerance):  # type: ignore[no-untyped-def]
    """Means of what cameras say of sixteen pixels, each by its weight; UNKNOWN where none says anything.

    Args:
        moved: flat float32, disparities by camera, px or UNKNOWN.
        weights: float32 (N,), of the cameras.
        out: float32, overwritten from index `at` (intp) on.
        place, step: intp, index of the first pixel as the first camera says it; from camera to camera.
        tolerance: float32.

    Returns:
        uint32, where the nearest and the farthest are more than `tolerance` apart, the first pixel lowest.
    """
    arguments = moved, weights, out, place, step, at, tolerance

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        moved, weights, out = pointers(context, builder, signature, values, 3)
        place, step, at, tolerance = values[3:]
        count = context.make_array(signature.args[1])(context, builder, values[1])
        count = builder.extract_value(count.shape, 0)
        start = constant(builder, FLOAT, [0.0] * COUNT)
        low, high = constant(builder, FLOAT, [UNKNOWN] * COUNT), constant(builder, FLOAT, [-UNKNOWN] * COUNT)
        totals = [cgutils.alloca_once_value(builder, lanes.value) for lanes in (start, start, low, high)]
        with cgutils.for_range(builder, count) as loop:
            mean, total, nearest, farthest = (Lanes(builder, builder.load(each)) for each in totals)
            d = loaded(builder, moved, builder.add(place, builder.mul(loop.index, step)), FLOAT)
            known = d.is_(">", UNKNOWN)
            part = filled(builder, builder.load(builder.gep(weights, [loop.index]))).where(known, 0.0)
            sums = mean + part * d, total + part
            ends = d.where(d.is_(">", nearest), nearest), d.where(d.is_("<", farthest) & known, farthest)
            for each, lanes in zip(totals, (*sums, *ends), strict=True):
                builder.store(lanes.value, each)
        mean, total, nearest, farthest = (Lanes(builder, builder.load(each)) for each in totals)
        some = total.is_(">", 0.0)
        store((mean / total.where(some, 1.0)).where(some, UNKNOWN), out, at)
        return builder.zext((nearest - farthest).is_(">", filled(builder, tolerance)).bits(), WORD)

    return types.uint32(*arguments), generate


move_run: Any = intrinsic(_move_run)
vote_run: Any = intrinsic(_vote_run)
