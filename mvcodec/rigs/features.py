"""Points of the scene that several cameras see: found, matched robustly, and followed through the rig."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import Position
from mvcodec.frames import FrameSet, Picture
from mvcodec.workers import run_all

MOST_FEATURES = 2500
"""A picture; the strongest ones count."""

RATIO = 0.8
"""A match must be that much better than the second best (Lowe 2004)."""

MAGSAC_PX = 3.0
"""How far off a match may be from the two cameras' epipolar geometry before lenses are known."""

STILL_PX, STILL_SHARE = 1.0, 0.5
"""A rig stands still where so many features are so near to where they were."""

LEAST_STILL_PX = 0.15
"""What moves less than that from frame to frame counts as still."""

FEWEST = 12
"""Matches that two pictures must share to count as matched."""

_CONTRAST = 0.015


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """What is distinctive in one picture.

    Attributes:
        xy_px: float64 (N, 2), where (0, 0 is the centre of the first pixel).
        angles_deg: float64 (N,), the direction of each.
        descriptors: float32 (N, 128).
    """

    xy_px: NDArray[np.float64]
    angles_deg: NDArray[np.float64]
    descriptors: NDArray[np.float32]

    def kept(self, chosen: NDArray[np.bool_]) -> Features:
        """Some of them."""
        return Features(self.xy_px[chosen], self.angles_deg[chosen], self.descriptors[chosen])


@dataclass(frozen=True, slots=True, eq=False)
class Tracks:
    """Points of the scene, and where the cameras see them.

    Attributes:
        cameras: N of them.
        xy_px: float64 (T, N, 2), of each point in each camera's picture; anything where it isn't seen.
        seen: bool (T, N), two or more of each point.
        frame: int64 (T,), index into the frame sets that were given.
    """

    cameras: tuple[Position, ...]
    xy_px: NDArray[np.float64]
    seen: NDArray[np.bool_]
    frame: NDArray[np.int64]

    def kept(self, seen: NDArray[np.bool_]) -> Tracks:
        """Some of the observations, (T, N); points that fewer than two of them show go."""
        whole = seen.sum(axis=1) >= 2
        return Tracks(self.cameras, self.xy_px[whole], seen[whole], self.frame[whole])


@dataclass(frozen=True, slots=True)
class PairCount:
    """How well two pictures were matched: by the ratio test, and of these by one epipolar geometry."""

    one: Position
    other: Position
    matched: int
    agreed: int


def find_features(picture: Picture, most: int = MOST_FEATURES) -> Features:
    """SIFT features (Lowe 2004) of uint8 (H, W, 3) RGB."""
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    sift = cv2.SIFT.create(nfeatures=most, contrastThreshold=_CONTRAST)
    points, descriptors = sift.detectAndCompute(grey, None)
    if descriptors is None:
        return Features(np.empty((0, 2)), np.empty(0), np.empty((0, 128), np.float32))
    xy = np.array([point.pt for point in points], np.float64)
    return Features(xy, np.array([point.angle for point in points]), np.asarray(descriptors, np.float32))


def match(one: Features, other: Features, ratio: float = RATIO) -> NDArray[np.int64]:
    """(M, 2): indices of features that are each other's best match, and clearly."""
    if min(len(one.descriptors), len(other.descriptors)) < 2:
        return np.empty((0, 2), np.int64)
    products = one.descriptors @ other.descriptors.T
    squares = [np.einsum("nd,nd->n", f.descriptors, f.descriptors) for f in (one, other)]
    distances = np.maximum(squares[0][:, None] + squares[1][None] - 2 * products, 0)
    best = distances.argmin(axis=1)
    back = distances.argmin(axis=0)
    rows = np.arange(len(best))
    two = np.partition(distances, 1, axis=1)[:, :2]
    clear = (two[:, 0] < ratio**2 * two[:, 1]) & (back[best] == rows)
    return np.stack([rows[clear], best[clear]], axis=1).astype(np.int64)


def agreeing(
    one: NDArray[np.float64], other: NDArray[np.float64], threshold_px: float = MAGSAC_PX
) -> NDArray[np.bool_]:
    """(M,): which matches agree with one epipolar geometry, by MAGSAC++ (Barath et al. 2020)."""
    if len(one) < FEWEST:
        return np.zeros(len(one), bool)
    try:
        _, mask = cv2.findFundamentalMat(one, other, cv2.USAC_MAGSAC, threshold_px, 0.999, 2000)
    except cv2.error:  # where not a single geometry could be made of any few of them
        mask = None
    return np.zeros(len(one), bool) if mask is None else mask.ravel().astype(bool)


def neighbours(cameras: Sequence[Position]) -> list[tuple[Position, Position]]:
    """Pairs beside, above and across from each other on the grid of the cameras."""
    rows = sorted({row for row, _ in cameras})
    cols = sorted({col for _, col in cameras})
    pairs = []
    for row, col in cameras:
        i, j = rows.index(row), cols.index(col)
        for down, across in ((0, 1), (1, 0), (1, 1), (1, -1)):
            if i + down < len(rows) and 0 <= j + across < len(cols):
                other = rows[i + down], cols[j + across]
                if other in cameras:
                    pairs.append(((row, col), other))
    return pairs


def find_tracks(
    frame_sets: Sequence[FrameSet], cameras: Sequence[Position]
) -> tuple[Tracks, list[PairCount]]:
    """Points that at least two of the cameras see at the same time.

    Args:
        frame_sets: with the pictures of these cameras.
        cameras: places on the grid.

    Returns:
        The points, and how well each pair of neighbours was matched, all frame sets together.
    """
    order = tuple(cameras)
    pairs = neighbours(order)
    parts, counts = [], {pair: [0, 0] for pair in pairs}
    pictures = [frame_set.pictures[camera] for frame_set in frame_sets for camera in order]
    flat = run_all(find_features, pictures)
    every = [
        dict(zip(order, flat[at : at + len(order)], strict=True)) for at in range(0, len(flat), len(order))
    ]
    for number, found in enumerate(standing(every)):
        matched = run_all(_match_pair, [found[one] for one, _ in pairs], [found[other] for _, other in pairs])
        links = {}
        for pair, (many, kept) in zip(pairs, matched, strict=True):
            counts[pair][0] += many
            counts[pair][1] += len(kept)
            links[pair] = kept
        parts.append(linked(order, found, links, number))
    told = [PairCount(*pair, *counts[pair]) for pair in pairs]
    return _joined(order, parts), told


def standing(every: Sequence[Mapping[Position, Features]]) -> list[dict[Position, Features]]:
    """The features of several frames; where the rig stands still, those of the first that do so too.

    A camera may be late: then whatever moves is somewhere else in its pictures. What stands still tells
    the same in every frame.

    Args:
        every: the features of each camera, frame by frame.
    """
    if len(every) < 2:
        return [dict(found) for found in every]
    distances = [
        {camera: _least_moved(camera, number, every) for camera in found}
        for number, found in enumerate(every)
    ]
    merged = np.concatenate([far for found in distances for far in found.values()])
    still = merged[merged < STILL_PX]
    if not still.size or still.size < STILL_SHARE * merged.size:
        return [dict(found) for found in every]
    bound = max(LEAST_STILL_PX, 4 * float(np.median(still)))
    return [{camera: features.kept(distances[0][camera] <= bound) for camera, features in every[0].items()}]


def _least_moved(
    camera: Position, number: int, every: Sequence[Mapping[Position, Features]]
) -> NDArray[np.float64]:
    """(N,): how far from each feature of a frame the nearest one of the frame beside it is, px."""
    from scipy.spatial import cKDTree

    here = every[number][camera]
    there = every[number + 1 if number + 1 < len(every) else number - 1][camera]
    if not len(here.xy_px) or not len(there.xy_px):
        return np.full(len(here.xy_px), np.inf)
    distance, _ = cKDTree(there.xy_px).query(here.xy_px)
    return np.asarray(distance, np.float64)


def _match_pair(one: Features, other: Features) -> tuple[int, NDArray[np.int64]]:
    """How many matches there are, and those that agree with one geometry."""
    pairs = match(one, other)
    return len(pairs), pairs[agreeing(one.xy_px[pairs[:, 0]], other.xy_px[pairs[:, 1]])]


def linked(
    cameras: Sequence[Position],
    found: Mapping[Position, Features],
    links: Mapping[tuple[Position, Position], NDArray[np.int64]],
    frame: int,
) -> Tracks:
    """Tracks of one frame set: features that matches join. What a camera would see twice is none."""
    counts = [len(found[camera].xy_px) for camera in cameras]
    starts = np.concatenate([[0], np.cumsum(counts)])
    number = {camera: index for index, camera in enumerate(cameras)}
    ends = [kept + np.array([starts[number[end]] for end in pair]) for pair, kept in links.items()]
    edges = np.concatenate([np.empty((0, 2), np.int64), *ends])
    groups, label = _connected(edges, int(starts[-1]))
    camera = np.repeat(np.arange(len(cameras)), counts)
    times = np.zeros((groups, len(cameras)), np.int64)
    np.add.at(times, (label, camera), 1)
    xy = np.zeros((groups, len(cameras), 2))
    xy[label, camera] = np.concatenate([found[c].xy_px for c in cameras])
    usable = (times.max(axis=1) == 1) & (times.sum(axis=1) >= 2)
    seen = times[usable] > 0
    return Tracks(tuple(cameras), xy[usable], seen, np.full(len(seen), frame))


def _connected(edges: NDArray[np.int64], total: int) -> tuple[int, NDArray[np.int64]]:
    """(groups, label of each of `total` nodes). Few edges join a group: loading SciPy would take longer.

    Args:
        edges: int64 (E, 2).
    """
    first = np.arange(total)
    while True:
        lower = first.copy()
        for one, other in (edges.T, edges[:, ::-1].T):
            np.minimum.at(lower, one, first[other])
        if np.array_equal(lower, first):
            break
        first = lower[lower]
    groups, label = np.unique(first, return_inverse=True)
    return len(groups), label


def _joined(cameras: tuple[Position, ...], parts: Sequence[Tracks]) -> Tracks:
    return Tracks(
        cameras,
        np.concatenate([part.xy_px for part in parts]),
        np.concatenate([part.seen for part in parts]),
        np.concatenate([part.frame for part in parts]),
    )
