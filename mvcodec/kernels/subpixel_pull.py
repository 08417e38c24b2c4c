"""What a partner's grey says about the disparity between levels, pixel by pixel."""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba import njit, types  # Numba as a whole first: half of it fails while another thread imports it
from numba.extending import intrinsic
from numpy.typing import NDArray

from mvcodec.kernels.lanes import COUNT, FLOAT, WORD, constant, filled, loaded, store
from mvcodec.kernels.runs import pointers

FloatMap = NDArray[np.float32]

CUBIC = np.float32(-0.75)
"""Of the cubic convolution (Keys 1981) that OpenCV has as well."""
# Its coefficients, in single precision: whole numbers would make it double.
TWO, THREE = np.float32(CUBIC + 2), np.float32(CUBIC + 3)
FOUR, FIVE, EIGHT = np.float32(4 * CUBIC), np.float32(5 * CUBIC), np.float32(8 * CUBIC)


@njit(cache=True, nogil=True, inline="always")
def _cubic(before, here, after, beyond, t):  # type: ignore[no-untyped-def]
    """A value t after `here`, by cubic convolution of four samples."""
    one = np.float32(1)
    far, near_end, far_end = one + t, one - t, one + one - t
    w_before = ((CUBIC * far - FIVE) * far + EIGHT) * far - FOUR
    w_here = (TWO * t - THREE) * t * t + one
    w_after = (TWO * near_end - THREE) * near_end * near_end + one
    w_beyond = ((CUBIC * far_end - FIVE) * far_end + EIGHT) * far_end - FOUR
    return w_before * before + w_here * here + w_after * after + w_beyond * beyond


RUN = COUNT
"""Neighbours that are fetched at once where the partner's are neighbours too, but for steps of one."""
NOWHERE = np.int32(-1)


@njit(cache=True, nogil=True)
def _places(disparity, first, along, by, last, whole, parts, further):  # type: ignore[no-untyped-def]
    """Where the pixels of a row are seen: the pixel before that, what is left, and if the next is nearer."""
    for x in range(disparity.size):
        place = np.float32(first + along * np.int32(x)) - by * disparity[x]
        inside = (place >= np.float32(0)) & (place <= last)
        place = min(max(place, np.float32(0)), last)
        at = np.int32(place)
        whole[x], parts[x] = at, place - np.float32(at)
        further[x] = np.int32(np.rint(place)) - at if inside else NOWHERE


@intrinsic
def _spread(_typing, whole, apart, start, along):  # type: ignore[no-untyped-def]
    """Which of RUN pixels are seen one further than side by side, and where the first of the others would be.

    Args:
        whole, apart: int32, of a row; `apart` is written.
        start: intp, the first of them; along: int32, 1 along rows, else 0.

    Returns:
        int32, -1 where they are further apart than that.
    """
    arguments = whole, apart, start, along

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        whole, apart = pointers(context, builder, signature, values, 2)
        start, along = values[2:]
        first = builder.load(builder.gep(whole, [start]))
        lanes = constant(builder, WORD, range(COUNT)) * filled(builder, along)
        off = loaded(builder, whole, start, WORD) - lanes - filled(builder, first)
        none = ir.Constant(ir.IntType(COUNT), -1)
        further, nearer = (
            builder.icmp_unsigned("==", (off.is_("==", 0) | off.is_("==", other)).bits(), none)
            for other in (1, -1)
        )
        least = builder.select(further, first, builder.sub(first, ir.Constant(WORD, 1)))
        store(off + filled(builder, first) - filled(builder, least), apart, start)
        return builder.select(builder.or_(further, nearer), least, ir.Constant(WORD, -1))

    return types.int32(*arguments), generate


@intrinsic
def _fetch(_typing, source, apart, out, begin, stride, there):  # type: ignore[no-untyped-def]
    """RUN pixels of a plane from `begin` on, or those `stride` further where they are apart; all intp."""
    arguments = source, apart, out, begin, stride, there

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        source, apart, out = pointers(context, builder, signature, values, 3)
        begin, stride, there = values[3:]
        one, two = (loaded(builder, source, at, FLOAT) for at in (begin, builder.add(begin, stride)))
        store(two.where(loaded(builder, apart, there, WORD).is_(">", 0), one), out, there)
        return context.get_dummy_value()

    return types.void(*arguments), generate


@intrinsic
def _fetch_nearest(_typing, source, apart, further, out, begin, stride, there):  # type: ignore[no-untyped-def]
    """The same of the nearest pixels, which may be another one further."""
    arguments = source, apart, further, out, begin, stride, there

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        source, apart, further, out = pointers(context, builder, signature, values, 4)
        begin, stride, there = values[4:]
        second = builder.add(begin, stride)
        places = begin, second, builder.add(second, stride)
        one, two, three = (loaded(builder, source, at, FLOAT) for at in places)
        beyond = loaded(builder, further, there, WORD)
        off = loaded(builder, apart, there, WORD) + beyond.where(beyond.is_(">", 0))
        store(three.where(off.is_(">", 1), two.where(off.is_(">", 0), one)), out, there)
        return context.get_dummy_value()

    return types.void(*arguments), generate


@njit(cache=True, nogil=True)
def _residuals(grey, before, here, after, beyond, parts, found):  # type: ignore[no-untyped-def]
    for x in range(grey.size):
        found[x] = grey[x] - _cubic(before[x], here[x], after[x], beyond[x], parts[x])


@njit(cache=True, nogil=True)
def _between(slopes, next_slopes, parts):  # type: ignore[no-untyped-def]
    for x in range(slopes.size):
        slopes[x] = slopes[x] + parts[x] * (next_slopes[x] - slopes[x])


@njit(cache=True, nogil=True)
def _trust(residuals, slopes, disparity, there, further, by, near, scale, trusted):  # type: ignore[no-untyped-def]
    """How much each pixel counts, times its slope: 0 where the partner has no say."""
    for x in range(residuals.size):
        off = residuals[x] * scale
        counts = (further[x] >= 0) & (abs(there[x] - disparity[x]) < near)
        value = -by * slopes[x] / (np.float32(1) + off * off)
        trusted[x] = value if counts else np.float32(0)


@njit(cache=True, nogil=True)
def _add_products(one, other, factor, total):  # type: ignore[no-untyped-def]
    for x in range(total.size):
        total[x] += one[x] * factor * other[x]


@njit(cache=True, nogil=True)
def add_pull(
    disparity: FloatMap,
    grey: FloatMap,
    other_grey: FloatMap,
    other_slope: FloatMap,
    other_disparity: FloatMap,
    along_rows: bool,
    step: float,
    same_surface: float,
    grey_scale: float,
    pull: FloatMap,
    weight: FloatMap,
) -> None:
    """Add one partner's part of the normal equations of `mvcodec.stereo.subpixel.refine`.

    Args:
        disparity, grey: float32 (H, W), of the map's own camera.
        other_grey, other_slope, other_disparity: float32 (H, W), of the partner; its grey's slope along the
            baseline, grey levels a pixel.
        along_rows: whether the partner stands in the camera's row, else in its column.
        step: a pixel of disparity d is at x - step * d (y - step * d) of the partner.
        same_surface: the partner counts where its disparity differs by less, px.
        grey_scale: a difference of so many grey levels halves what it counts.
        pull, weight: float32 (H, W), added to.
    """
    height, width = disparity.shape
    last = width - 1 if along_rows else height - 1
    stride = 1 if along_rows else width
    by, along = np.float32(step), np.int32(1 if along_rows else 0)
    flat_grey, flat_slope = other_grey.reshape(-1), other_slope.reshape(-1)
    flat_there = other_disparity.reshape(-1)
    # Each by itself: rows of one array are not told apart, and nothing is vectorised then.
    whole, further, apart = np.empty(width, np.int32), np.empty(width, np.int32), np.empty(width, np.int32)
    parts, residuals = np.empty(width, np.float32), np.empty(width, np.float32)
    trusted, there = np.empty(width, np.float32), np.empty(width, np.float32)
    before, here = np.empty(width, np.float32), np.empty(width, np.float32)
    after, beyond = np.empty(width, np.float32), np.empty(width, np.float32)
    slopes, next_slopes = np.empty(width, np.float32), np.empty(width, np.float32)
    scale, near = np.float32(1 / grey_scale), np.float32(same_surface)
    for y in range(height):
        row = np.int32(0 if along_rows else y)
        _places(disparity[y], row, along, by, np.float32(last), whole, parts, further)
        for start in range(0, width, RUN):
            least = np.int64(_spread(whole, apart, start, along)) if start + RUN <= width else np.int64(-1)  # type: ignore[call-arg]
            if least >= 1 and least + RUN * along + 3 <= last:
                begin = y * width + least if along_rows else least * width + start
                _fetch(flat_grey, apart, before, begin - stride, stride, start)  # type: ignore[call-arg]
                _fetch(flat_grey, apart, here, begin, stride, start)
                _fetch(flat_grey, apart, after, begin + stride, stride, start)
                _fetch(flat_grey, apart, beyond, begin + 2 * stride, stride, start)
                _fetch(flat_slope, apart, slopes, begin, stride, start)
                _fetch(flat_slope, apart, next_slopes, begin + stride, stride, start)
                _fetch_nearest(flat_there, apart, further, there, begin, stride, start)
                continue
            for k in range(min(RUN, width - start)):
                x = start + k
                at = int(whole[x])
                begin_at = y * width if along_rows else x
                before[x] = flat_grey[begin_at + max(at - 1, 0) * stride]
                here[x] = flat_grey[begin_at + at * stride]
                after[x] = flat_grey[begin_at + min(at + 1, last) * stride]
                beyond[x] = flat_grey[begin_at + min(at + 2, last) * stride]
                slopes[x] = flat_slope[begin_at + at * stride]
                next_slopes[x] = flat_slope[begin_at + min(at + 1, last) * stride]
                there[x] = flat_there[begin_at + min(at + max(further[x], 0), last) * stride]
        _residuals(grey[y], before, here, after, beyond, parts, residuals)
        _between(slopes, next_slopes, parts)
        _trust(residuals, slopes, disparity[y], there, further, by, near, scale, trusted)
        _add_products(trusted, residuals, np.float32(1), pull[y])
        _add_products(trusted, slopes, -by, weight[y])
