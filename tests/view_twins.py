"""Plain twins of the view kernels and of the whole default renderer, written down from their docstrings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.frames import DecodedSet, FloatMap, Mask, Picture
from mvcodec.synthesis.camera_spread import measure_spread
from mvcodec.synthesis.cell_cameras import FADE
from mvcodec.synthesis.layered import LayeredSettings

UNKNOWN = -1e9
BORDER = 2
STEPS = 32
"""Places between two pixels that a fetch tells apart."""
LUMA = np.array([0.299, 0.587, 0.114])


def splat(disparity: FloatMap, shift_x: float, shift_y: float, reach: float) -> FloatMap:
    """float32 (H + 2, W + 2); place (0, 0) is pixel (-1, -1). For a reach below 1."""
    height, width = disparity.shape
    out = np.full((height + 2, width + 2), UNKNOWN, np.float32)
    columns, rows = np.arange(-1, width + 1), np.arange(-1, height + 1)[:, None]
    for y, x in np.ndindex(height, width):
        d = disparity[y, x]
        across = np.abs(columns - np.clip(x - shift_x * d, -1, width)) <= reach
        down = np.abs(rows - np.clip(y - shift_y * d, -1, height)) <= reach
        covered = across & down
        out[covered] = np.maximum(out[covered], d)
    return out


class Ballot(NamedTuple):
    """Who votes: maps, luma with its border, shifts (x, y) from the view for a px of disparity, weights."""

    maps: NDArray[np.float32]
    lumas: NDArray[np.float32]
    shifts: NDArray[np.float32]
    weights: NDArray[np.float32]


class Limits(NamedTuple):
    """Of the vote, as in `LayeredSettings`."""

    tolerance: float
    contrast: float
    ratio: float
    denial: float


def outvote(place: tuple[int, int], said: Mapping[int, float], ballot: Ballot, limits: Limits) -> float:
    """The winner among the disparities that cameras say of (y, x), UNKNOWN among none."""
    surfaces: list[list[int]] = []
    for camera in sorted(said, key=lambda camera: -said[camera]):
        if surfaces and said[surfaces[-1][0]] - said[camera] <= limits.tolerance:
            surfaces[-1].append(camera)
        else:
            surfaces.append([camera])
    best, strength = UNKNOWN, 0.0
    for surface in surfaces:
        weights = [float(ballot.weights[camera]) for camera in surface]
        if surface is surfaces[0] or sum(weights) > limits.ratio * strength:
            best = float(np.average([said[camera] for camera in surface], weights=weights))
            seen = [luma_around(place, best, ballot, camera)[1, 1] for camera in surface]
            luma = float(np.average(seen, weights=weights))
            against = sum(
                float(weight)
                for camera, weight in enumerate(ballot.weights)
                if camera not in surface and denies(place, best, luma, ballot, camera, limits)
            )
            strength = max(sum(weights) - limits.denial * against, 0)
    return best


def pixel(place: tuple[int, int], d: float, shift: NDArray[np.float32]) -> tuple[int, int]:
    """(row, column) of a camera's pixel nearest to where the view's point (y, x) at d would stand."""
    row, column = (np.floor(p + s * d + 0.5) for p, s in zip(place, shift[::-1], strict=True))
    return int(row), int(column)


def luma_around(place: tuple[int, int], d: float, ballot: Ballot, camera: int) -> NDArray[np.float32]:
    """3 x 3 around that pixel, or the nearest one of the picture."""
    size = ballot.maps.shape[1:]
    row, column = (
        min(max(p, 0), s - 1) for p, s in zip(pixel(place, d, ballot.shifts[camera]), size, strict=True)
    )
    return ballot.lumas[camera, row + 1 : row + 4, column + 1 : column + 4]


def denies(
    place: tuple[int, int], d: float, luma: float, ballot: Ballot, camera: int, limits: Limits
) -> bool:
    """Whether the camera sees something farther, of another luma, in place of the view's point (y, x)."""
    row, column = pixel(place, d, ballot.shifts[camera])
    height, width = ballot.maps.shape[1:]
    if not (0 <= row < height and 0 <= column < width):
        return False
    around = luma_around(place, d, ballot, camera)
    farther = ballot.maps[camera, row, column] < d - limits.tolerance
    return bool(farther and (np.abs(around - luma) > limits.contrast).all())


def vote(moved: NDArray[np.float32], ballot: Ballot, limits: Limits) -> FloatMap:
    inner = moved[:, 1:-1, 1:-1]
    out = np.empty(inner.shape[1:], np.float32)
    for y, x in np.ndindex(*out.shape):
        said = {i: float(d) for i, d in enumerate(inner[:, y, x]) if d > np.float32(UNKNOWN)}
        out[y, x] = outvote((y, x), said, ballot, limits)
    return out


def fill_background(disparity: FloatMap, fallback: float) -> FloatMap:
    out = disparity.copy()
    for y, row in enumerate(disparity):
        known = np.flatnonzero(row > np.float32(UNKNOWN))
        for x in np.flatnonzero(row <= np.float32(UNKNOWN)):
            ends = [*known[known < x][-1:], *known[known > x][:1]]
            out[y, x] = min((row[end] for end in ends), default=fallback)
    return out


def spread(disparity: FloatMap, before: int, after: int) -> FloatMap:
    """Largest minus smallest disparity from `before` px left of and above each pixel to `after` px beyond."""
    padded = np.pad(disparity, (before, after), mode="edge")
    size = before + after + 1
    windows = np.lib.stride_tricks.sliding_window_view(padded, (size, size))
    return np.asarray(windows.max((2, 3)) - windows.min((2, 3)), np.float32)


def split_luma(picture: Picture, border: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Y (H + 2 border, W + 2 border), and (R - Y, B - Y) of that size."""
    padded = np.pad(picture, ((border, border), (border, border), (0, 0)), mode="edge").astype(float)
    luma = padded @ LUMA
    return luma, padded[..., [0, 2]] - luma[..., None]


def keys(distance: float, a: float) -> float:
    """Cubic convolution's kernel (Keys 1981, equation 4 with free a)."""
    s = abs(distance)
    if s < 1:
        return (a + 2) * s**3 - (a + 3) * s**2 + 1
    return a * s**3 - 5 * a * s**2 + 8 * a * s - 4 * a if s < 2 else 0.0


@dataclass(frozen=True)
class Source:
    """A camera: its picture, its map, and `shift`, px (x, y) from the view to it for each px of disparity."""

    picture: Picture
    disparity: FloatMap
    shift: tuple[float, float]
    weight: float

    def sees(
        self, x: int, y: int, d: float, settings: LayeredSettings
    ) -> tuple[float, NDArray[np.float64]] | None:
        """Its weight, and (Y, R - Y, B - Y) of the view's point (x, y) at disparity d; None if unseen."""
        height, width = self.disparity.shape
        at_x, at_y = x + self.shift[0] * d, y + self.shift[1] * d
        if not (-0.5 < at_x < width - 0.5 and -0.5 < at_y < height - 0.5):
            return None
        at_x, at_y = np.clip(at_x, 0, width - 1), np.clip(at_y, 0, height - 1)
        left, top = int(at_x), int(at_y)
        at_x, at_y = (
            pixel + np.floor((at - pixel) * STEPS + 0.5) / STEPS for at, pixel in ((at_x, left), (at_y, top))
        )
        columns, rows = (
            np.arange(left - 1, left + 3).clip(0, width - 1),
            np.arange(top - 1, top + 3).clip(0, height - 1),
        )
        window = self.picture[np.ix_(rows, columns)].astype(float)
        depths = self.disparity[np.ix_(rows, columns)]
        linear = np.outer(
            [max(0.0, 1 - abs(at_y - top - j)) for j in (-1, 0, 1, 2)],
            [max(0.0, 1 - abs(at_x - left - i)) for i in (-1, 0, 1, 2)],
        )
        if max(np.ptp(depths) / 2, np.ptp(depths[1:3, 1:3])) > settings.tolerance_px:
            return self._at_contour(window, linear * (np.abs(depths - d) <= settings.tolerance_px), settings)
        if abs(self.disparity[top, left] - d) > settings.tolerance_px:
            return None
        cubic = np.outer(
            [keys(at_y - top - j, settings.sharpness) for j in (-1, 0, 1, 2)],
            [keys(at_x - left - i, settings.sharpness) for i in (-1, 0, 1, 2)],
        )
        return self.weight, _luma_and_differences(window, cubic, linear)

    def _at_contour(
        self, window: NDArray[np.float64], parts: NDArray[np.float64], settings: LayeredSettings
    ) -> tuple[float, NDArray[np.float64]] | None:
        share = float(parts.sum())
        if share <= 1e-3:
            return None
        parts = parts / share
        return share * self.weight * settings.edge_trust, _luma_and_differences(window, parts, parts)


def _luma_and_differences(
    window: NDArray[np.float64], for_luma: NDArray[np.float64], for_colour: NDArray[np.float64]
) -> NDArray[np.float64]:
    luma = window @ LUMA
    return np.array(
        [
            (luma * for_luma).sum(),
            ((window[..., 0] - luma) * for_colour).sum(),
            ((window[..., 2] - luma) * for_colour).sum(),
        ]
    )


def surfaces_around(view_disparity: FloatMap, x: int, y: int, tolerance: float) -> list[tuple[float, float]]:
    """(disparity, weight) of each surface of the 3 x 3 window, that of the pixel itself first."""
    height, width = view_disparity.shape
    found = [(float(view_disparity[y, x]), 1.0)]
    for v in range(max(y - 1, 0), min(y + 2, height)):
        for u in range(max(x - 1, 0), min(x + 2, width)):
            if (u, v) == (x, y):
                continue
            d, weight = float(view_disparity[v, u]), 1 / (1 + (u - x) ** 2 + (v - y) ** 2)
            for k, (surface, so_far) in enumerate(found):
                if abs(surface - d) <= tolerance:
                    found[k] = surface, so_far + weight
                    break
            else:
                found.append((d, weight))
    return found


def blend(
    sources: Sequence[Source], view_disparity: FloatMap, settings: LayeredSettings
) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """RGB in 0..255, not yet rounded, and the number of cameras (0 where black: none sees the pixel)."""
    height, width = view_disparity.shape
    out, seen_by = np.zeros((height, width, 3)), np.zeros((height, width), np.uint8)
    for y, x in np.ndindex(height, width):
        mixed, total = np.zeros(3), 0.0
        for k, (d, part) in enumerate(surfaces_around(view_disparity, x, y, settings.tolerance_px)):
            seen = [fetch for source in sources if (fetch := source.sees(x, y, d, settings)) is not None]
            if k == 0:
                seen_by[y, x] = len(seen)
            if seen and seen_by[y, x] > 0:
                fetched = sum((weight * colour for weight, colour in seen), np.zeros(3))
                mixed += part * fetched / sum(weight for weight, _ in seen)
                total += part
        if total > 0:
            grey, red, blue = mixed / total
            green = grey - (LUMA[0] * red + LUMA[2] * blue) / LUMA[1]
            out[y, x] = np.clip((grey + red, green, grey + blue), 0, 255)
    return out, seen_by


def paint_holes(
    picture: Picture, disparity: FloatMap, seen_by: NDArray[np.uint8], tolerance: float, reach: int
) -> Picture:
    out = picture.copy()
    inside = np.pad(np.ones(seen_by.shape, np.bool_), reach)
    for y, x in np.argwhere(seen_by == 0):
        found: list[tuple[float, float, NDArray[np.uint8]]] = []
        for step in ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)):
            for distance in range(1, reach + 1):
                v, u = y + distance * step[0], x + distance * step[1]
                if not inside[v + reach, u + reach]:
                    break
                if seen_by[v, u]:
                    found.append((float(disparity[v, u]), 1 / ((v - y) ** 2 + (u - x) ** 2), picture[v, u]))
                    break
        background = [f for f in found if f[0] <= min(d for d, _, _ in found) + tolerance]
        if background:
            mean = sum((weight * colour for _, weight, colour in background), np.zeros(3))
            out[y, x] = np.floor(mean / sum(weight for _, weight, _ in background) + 0.5)
    return out


def median3(disparity: FloatMap) -> FloatMap:
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(disparity, 1, mode="edge"), (3, 3))
    return np.asarray(np.median(windows, axis=(2, 3)), np.float32)


Place = tuple[int, int]


def smooth_over(disparity: FloatMap, step: float, reach: int, fewest: int) -> FloatMap:
    height, width = disparity.shape
    out = disparity.copy()

    def near(place: Place, far: int) -> list[Place]:
        y, x = place
        rows, columns = range(max(y - far, 0), min(y + far + 1, height)), range(max(x - far, 0), x + far + 1)
        return [(v, u) for v in rows for u in columns if u < width]

    def alike(one: Place, other: Place) -> bool:
        return bool(abs(disparity[one] - disparity[other]) <= step)

    def groups(reach: int, joined: Callable[[Place, Place], bool]) -> list[list[Place]]:
        found, met = [], set[Place]()
        for place in np.ndindex(height, width):
            group = [] if place in met else [place]
            for here in group:
                met.add(here)
                group += [
                    there
                    for there in near(here, reach)
                    if there not in {*met, *group} and joined(here, there)
                ]
            found += [group] if group else []
        return found

    pieces = groups(reach, alike)
    small = {place for piece in pieces if len(piece) < fewest for place in piece}

    def together(one: Place, other: Place) -> bool:
        return {one, other} <= small and (alike(one, other) or other in near(one, 1))

    for group in groups(reach, together):
        around = [disparity[there] for here in group for there in near(here, 1) if there not in small]
        if group[0] in small and around:
            for here in group:
                out[here] = sorted(around)[len(around) // 2]
    return out


def restore_thin(voted: FloatMap, tolerance: float, cleaned: FloatMap) -> FloatMap:
    out = cleaned.copy()
    height, width = voted.shape
    for y, x in np.ndindex(height, width):
        d = voted[y, x]
        beside = [
            voted[v, u]
            for v in (y - 1, y, y + 1)
            for u in (x - 1, x, x + 1)
            if (v, u) != (y, x) and 0 <= v < height and 0 <= u < width
        ]
        alike = sum(abs(other - d) <= tolerance for other in beside)
        if d > UNKNOWN and abs(cleaned[y, x] - d) > tolerance and alike >= 2:
            out[y, x] = d
    return out


def camera_weight(array: CameraArray, camera: Position, viewpoint: Viewpoint, camera_spread: float) -> float:
    """1 / (spread + squared distance in cells), less towards a border with a cell that lacks this camera."""
    cell = array.cell_at(viewpoint)
    down = abs(viewpoint.row - camera[0]) / (array.row_step or 1)
    across = abs(viewpoint.col - camera[1]) / (array.col_step or 1)
    weight = 1 / (camera_spread + across**2 + down**2)
    for distance, place, first, last, end in (
        (down, camera[0], cell.top, cell.bottom, array.rows - 1),
        (across, camera[1], cell.left, cell.right, array.cols - 1),
    ):
        if (place == first and last < end) or (place == last and first > 0):
            weight *= min(1, (1 - distance) / FADE)
    return weight


def render(
    decoded: DecodedSet, viewpoint: Viewpoint, settings: LayeredSettings
) -> tuple[NDArray[np.float64], FloatMap, NDArray[np.uint8], Mask]:
    """A whole view between cameras: RGB not yet rounded, disparity, seen_by, and which pixels are painted."""
    array = decoded.array
    camera_spread = settings.spread or measure_spread(decoded)
    sources = []
    for camera in array.cell_at(viewpoint).cameras:
        weight = camera_weight(array, camera, viewpoint, camera_spread)
        if weight > 0:
            shift = array.shift_per_disparity(camera, viewpoint)
            disparity = decoded.disparities[camera].values_px
            sources.append(Source(decoded.pictures[camera], disparity, shift, weight))
    moved = np.stack([splat(source.disparity, *source.shift, settings.reach_px) for source in sources])
    ballot = Ballot(
        np.stack([source.disparity for source in sources]),
        np.stack([split_luma(source.picture, BORDER)[0] for source in sources]).astype(np.float32),
        np.array([source.shift for source in sources], np.float32),
        np.array([source.weight for source in sources], np.float32),
    )
    limits = Limits(settings.tolerance_px, settings.contrast, settings.ratio, settings.denial)
    voted = vote(moved, ballot, limits)
    cleaned = restore_thin(voted, settings.tolerance_px, median3(voted))
    filled = fill_background(cleaned, decoded.disparity_range_px[0])
    disparity = smooth_over(filled, settings.tolerance_px, 1, settings.speck_area_px)
    colours, seen_by = blend(sources, disparity, settings)
    rounded = np.floor(colours + 0.5).astype(np.uint8)
    painted = paint_holes(rounded, disparity, seen_by, settings.tolerance_px, settings.hole_reach_px)
    return np.where((seen_by == 0)[..., None], painted, colours), disparity, seen_by, seen_by == 0
