"""Pictures of calibration boards as known cameras see them."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from mvcodec.frames import Picture
from mvcodec.rigs.board import Board
from mvcodec.rigs.calibration_files import KnownCamera
from mvcodec.rigs.residuals import rays

Vectors = NDArray[np.float64]
_SQUARE_PX = 32


def board_picture(board: Board) -> tuple[Picture, Vectors]:
    """The board drawn flat with a white rim, and (2,): where in it the board's first corner is, px."""
    if board.dictionary:
        made = cv2.aruco.CharucoBoard(
            (board.cols, board.rows),
            board.square_m,
            board.marker_m,
            cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{board.dictionary}")),
        )
        squares = np.asarray(made.generateImage((board.cols * _SQUARE_PX, board.rows * _SQUARE_PX)))
    else:
        y, x = np.mgrid[: board.rows + 1, : board.cols + 1]
        squares = np.kron((x + y) % 2, np.ones((_SQUARE_PX, _SQUARE_PX))).astype(np.uint8) * 255
    rim = _SQUARE_PX
    # The first inner corner lies one square and the rim from the edge, between two pixels.
    first = np.full(2, rim + _SQUARE_PX - 0.5)
    drawn = cv2.copyMakeBorder(squares, rim, rim, rim, rim, cv2.BORDER_CONSTANT, value=(255,))
    return np.asarray(drawn, np.uint8), first


def seen_by(camera: KnownCamera, board: Board, turn: Vectors, shift_m: Vectors) -> Picture:
    """uint8 (H, W, 3): the board, turned and then moved, before grey."""
    drawn, first = board_picture(board)
    width, height = camera.size
    y, x = np.mgrid[:height, :width]
    slopes = rays(camera.lens, np.column_stack([x.ravel(), y.ravel()]).astype(float))
    directions = np.column_stack([slopes, np.ones(len(slopes))]) @ camera.turn
    # Where each ray meets the board's plane, in the board's axes.
    origin, directions = turn.T @ (camera.centre_m - shift_m), directions @ turn
    on = origin[:2] - directions[:, :2] / directions[:, 2:] * origin[2]
    places = on / board.square_m * _SQUARE_PX + first
    there = places.reshape(height, width, 2).astype(np.float32)
    soft = cv2.GaussianBlur(drawn, (0, 0), 1.0)
    grey = cv2.remap(soft, there[..., 0], there[..., 1], cv2.INTER_LINEAR, borderValue=(110,))
    return np.repeat(np.asarray(grey, np.uint8)[..., None], 3, axis=2)


def held(count: int, seed: int, middle_m: Sequence[float]) -> list[tuple[Vectors, Vectors]]:
    """Turns and shifts of a board that somebody holds here and there, facing the cameras."""
    draw = np.random.default_rng(seed)
    poses = []
    for _ in range(count):
        turn = Rotation.from_euler(
            "xyz", draw.uniform((-32, -32, -15), (32, 32, 15)), degrees=True
        ).as_matrix()
        poses.append((turn, np.array(middle_m) + draw.uniform(-1, 1, 3) * (0.12, 0.08, 0.1)))
    return poses
