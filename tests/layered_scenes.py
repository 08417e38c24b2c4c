"""Exact scenes for the default renderer, and what of a view must be exact."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import lru_cache

import cv2
import numpy as np
import view_twins as twins
from plane_scene import Plane, PlaneScene

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.frames import DecodedSet, DisparityMap, FloatMap, Mask, Picture, RenderedView
from mvcodec.scenes.scene import RoomScene, SceneSettings
from mvcodec.synthesis.layered import Layered

LAYERED = Layered()


def render(decoded: DecodedSet, row: float, col: float) -> RenderedView:
    return LAYERED.render(decoded, Viewpoint(row, col))


def with_disparities(decoded: DecodedSet, values: Mapping[Position, FloatMap]) -> DecodedSet:
    """The same pictures, other maps for some cameras."""
    every = np.ones((decoded.array.height, decoded.array.width), np.bool_)
    changed = {camera: DisparityMap(map_, every) for camera, map_ in values.items()}
    return replace(decoded, disparities={**decoded.disparities, **changed})


def without(decoded: DecodedSet, *cameras: Position) -> DecodedSet:
    return replace(
        decoded,
        pictures={camera: p for camera, p in decoded.pictures.items() if camera not in cameras},
        disparities={camera: d for camera, d in decoded.disparities.items() if camera not in cameras},
    )


def grown(mask: Mask, px: int) -> Mask:
    size = 2 * px + 1
    return np.asarray(cv2.dilate(mask.astype(np.uint8), np.ones((size, size), np.uint8)) > 0)


def contours(disparity: FloatMap) -> Mask:
    """Pixels with another surface beside them."""
    return np.asarray(twins.spread(disparity, 1, 1) > 0)


def used(array: CameraArray, viewpoint: Viewpoint) -> list[Position]:
    """The cameras of the view's cell that count."""
    cameras = array.cell_at(viewpoint).cameras
    return [c for c in cameras if twins.camera_weight(array, c, viewpoint, 1.0) > 0]


def seen_by_any(scene: PlaneScene, viewpoint: Viewpoint, cameras: Collection[Position]) -> Mask:
    return np.asarray(np.any([scene.seen_from(viewpoint, camera) for camera in cameras], axis=0))


def certain(disparity: FloatMap) -> Mask:
    """All but the pixels of a surface beside a farther one, which are soft, and corners.

    The median over 3 x 3 pixels rounds corners off.
    """
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(disparity, 1, mode="edge"), (3, 3))
    return np.asarray((disparity == windows.min((2, 3))) & ~corners(disparity))


def corners(disparity: FloatMap) -> Mask:
    """Pixels near which contours of both directions meet."""
    down, across = np.zeros(disparity.shape, np.bool_), np.zeros(disparity.shape, np.bool_)
    down[1:] = disparity[1:] != disparity[:-1]
    across[:, 1:] = disparity[:, 1:] != disparity[:, :-1]
    return grown(grown(down, 2) & grown(across, 2), 1)


def smooth_view(array: CameraArray, viewpoint: Viewpoint, d: float, colours: bool) -> Picture:
    """A plane at disparity d whose texture has no wave shorter than 8 px."""
    right, down = array.shift_per_disparity((0, 0), viewpoint)
    y, x = np.mgrid[: array.height, : array.width] + np.array([down * d, right * d])[:, None, None]
    waves = [
        35 * np.sin(2 * np.pi * (x + y / 3) / 9 + k)
        + 35 * np.sin(2 * np.pi * (y - x / 5) / 8 + 2 * k)
        + 35 * np.sin(2 * np.pi * (x + y) / 40)
        for k in ((0, 1, 2) if colours else (0, 0, 0))
    ]
    return np.rint(127.5 + np.stack(waves, axis=-1)).astype(np.uint8)


def box_scene(array: CameraArray, near: int, far: int, box: tuple[int, int, int, int]) -> PlaneScene:
    """A reddish box before a bluish background."""
    scene = PlaneScene(array, far, (Plane(near, box),))
    background, front = scene.textures
    for texture in scene.textures:
        np.floor_divide(texture, 6, out=texture)
    background[..., 2] += 200
    front[..., 0] += 200
    return scene


def outside_px(
    array: CameraArray, viewpoint: Viewpoint, near: int, box: tuple[int, int, int, int]
) -> FloatMap:
    """How far (px, the larger of across and down) each pixel's centre lies outside the box."""
    right, down = array.shift_per_disparity((0, 0), viewpoint)
    y, x = np.mgrid[: array.height, : array.width] + np.array([down, right])[:, None, None] * near
    top, left, bottom, end = box
    vertical = np.maximum(top - 0.5 - y, y - (bottom - 0.5))
    return np.asarray(np.maximum(vertical, np.maximum(left - 0.5 - x, x - (end - 0.5))), np.float32)


@lru_cache(maxsize=2)
def room(rows: int, cols: int, step: int) -> tuple[DecodedSet, dict[Position, tuple[Picture, FloatMap]]]:
    """The sample room with exact maps, and the truth of every view (disparity of a cell)."""
    scene = RoomScene(SceneSettings(grid=(rows, cols), size=(240, 136), frames=1))
    array = replace(scene.array, real_rows=tuple(range(0, rows, step)), real_cols=tuple(range(0, cols, step)))
    seen = {place: scene.render(Viewpoint(*place), 0) for place in array.positions}
    truth = {place: (picture, disparity * array.col_step) for place, (picture, disparity) in seen.items()}
    every = np.ones((array.height, array.width), np.bool_)
    decoded = DecodedSet(
        array,
        index=0,
        time_ns=0,
        pictures={camera: truth[camera][0] for camera in array.real},
        disparities={camera: DisparityMap(truth[camera][1], every) for camera in array.real},
        disparity_range_px=(0.0, 30.0 * step),
    )
    return decoded, truth
