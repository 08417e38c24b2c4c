"""Calibration boards: what they look like, and where pictures show their corners."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import Position
from mvcodec.errors import SettingError
from mvcodec.frames import FrameSet, Picture
from mvcodec.workers import run_all

Vectors = NDArray[np.float64]

EXPECTED = (
    "charuco:COLSxROWS:SQUARE:MARKER:DICTIONARY such as charuco:7x5:40mm:30mm:4X4_50 (squares), or"
    " chessboard:COLSxROWS:SQUARE such as chessboard:9x6:25mm (inner corners)"
)
FEWEST_CORNERS = 8
"""Of a board that count as a sighting."""

_METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
_SPEC = re.compile(
    r"(?:charuco:(?P<squares>\d{1,3}x\d{1,3}):(?P<square>[\d.]+[a-z]+):(?P<marker>[\d.]+[a-z]+):(?P<words>\w+)"
    r"|chessboard:(?P<corners>\d{1,3}x\d{1,3}):(?P<side>[\d.]+[a-z]+))"
)
_LENGTH = re.compile(r"(\d+\.?\d*|\.\d+)(mm|cm|m|in)")


@dataclass(frozen=True, slots=True)
class Board:
    """A flat board with corners.

    Attributes:
        text: as the user wrote it.
        cols, rows: squares of a ChArUco board; inner corners of a chessboard.
        square_m: side of a square.
        marker_m: side of a marker; 0 of a chessboard.
        dictionary: of the markers, such as `4X4_50`; empty of a chessboard.
    """

    text: str
    cols: int
    rows: int
    square_m: float
    marker_m: float = 0.0
    dictionary: str = ""

    @classmethod
    def from_text(cls, text: str) -> Board:
        """See EXPECTED.

        Raises:
            SettingError: another text, or a board that there cannot be.
        """
        match = _SPEC.fullmatch(text)
        if match is None:
            raise SettingError("board", repr(text), EXPECTED)
        cols, rows = (int(side) for side in (match["squares"] or match["corners"]).split("x"))
        square_m = _length_m(text, match["square"] or match["side"])
        if min(cols, rows) < 3:
            raise SettingError("board", f"{cols}x{rows} in {text!r}", "at least 3 each way")
        if match["corners"]:
            if cols == rows:
                expected = "unequal numbers of inner corners: which way up an equal one lies cannot be told"
                raise SettingError("board", f"{cols}x{rows} in {text!r}", expected)
            return cls(text, cols, rows, square_m)
        marker_m = _length_m(text, match["marker"])
        if not marker_m < square_m:
            found = f"markers of {match['marker']} in squares of {match['square']}"
            raise SettingError("board", found, "markers that are smaller than the squares")
        name = match["words"].upper().removeprefix("DICT_")
        if not hasattr(cv2.aruco, f"DICT_{name}"):
            known = sorted({key[5:].upper() for key in dir(cv2.aruco) if key.startswith("DICT_")})
            raise SettingError("board", f"the dictionary {match['words']}", " | ".join(known))
        held, needed = len(_dictionary(name).bytesList), cols * rows // 2
        if held < needed:
            raise SettingError(
                "board", f"the dictionary {name} of {held} markers", f"one of {needed} or more"
            )
        return cls(text, cols, rows, square_m, marker_m, name)

    @property
    def corners_m(self) -> Vectors:
        """float64 (C, 3): its corners in its own axes, row by row."""
        cols, rows = (self.cols - 1, self.rows - 1) if self.dictionary else (self.cols, self.rows)
        y, x = np.mgrid[:rows, :cols]
        return np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]) * self.square_m


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """Where the cameras show a board's corners.

    Attributes:
        board: the board.
        cameras: N of them.
        size: (width, height) of their pictures, px.
        xy_px: float64 (F, N, C, 2); anything where a corner isn't seen. F frame sets that show the board.
        seen: bool (F, N, C).
        looked_at: frame sets that were searched.
    """

    board: Board
    cameras: tuple[Position, ...]
    size: tuple[int, int]
    xy_px: Vectors
    seen: NDArray[np.bool_]
    looked_at: int

    def of_frames(self, chosen: NDArray[np.int64]) -> Sightings:
        """Some of the frame sets."""
        return Sightings(
            self.board, self.cameras, self.size, self.xy_px[chosen], self.seen[chosen], self.looked_at
        )


def find_board(
    board: Board, frame_sets: Iterable[FrameSet], cameras: tuple[Position, ...], size: tuple[int, int]
) -> Sightings:
    """Look for a board in pictures.

    Args:
        board: the board.
        frame_sets: with the pictures of these cameras.
        cameras: N of them.
        size: (width, height) of the pictures, px.
    """
    finder = _CharucoFinder(board) if board.dictionary else _ChessboardFinder(board)
    count = len(board.corners_m)
    places, seen, looked_at = [], [], 0
    for frame_set in frame_sets:
        looked_at += 1
        found = dict(
            zip(cameras, run_all(finder.find, [frame_set.pictures[at] for at in cameras]), strict=True)
        )
        if not board.dictionary:
            found = _same_way_up(found)
        xy, there = np.zeros((len(cameras), count, 2)), np.zeros((len(cameras), count), bool)
        for number, at in enumerate(cameras):
            numbers, where = found[at]
            if len(numbers) >= FEWEST_CORNERS:
                xy[number, numbers], there[number, numbers] = where, True
        if there.any():
            places.append(xy)
            seen.append(there)
    shape = len(places), len(cameras), count
    return Sightings(
        board, cameras, size, np.reshape(places, (*shape, 2)), np.reshape(seen, shape).astype(bool), looked_at
    )


Found = tuple[NDArray[np.int64], Vectors]
"""Numbers of corners, and where they are, px."""


class _CharucoFinder:
    """Boards of before OpenCV 4.6 have their markers in the other squares: what is found first counts."""

    def __init__(self, board: Board) -> None:
        self._detectors = []
        for legacy in (False, True):
            made = cv2.aruco.CharucoBoard(
                (board.cols, board.rows), board.square_m, board.marker_m, _dictionary(board.dictionary)
            )
            made.setLegacyPattern(legacy)
            parameters = cv2.aruco.DetectorParameters()
            parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
            self._detectors.append(cv2.aruco.CharucoDetector(made, cv2.aruco.CharucoParameters(), parameters))

    def find(self, picture: Picture) -> Found:
        grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
        for detector in tuple(self._detectors):
            corners, numbers, _, _ = detector.detectBoard(grey)
            if numbers is not None and len(numbers) >= FEWEST_CORNERS:
                self._detectors = [detector]
                return numbers.ravel().astype(np.int64), corners.reshape(-1, 2).astype(np.float64)
        return _nothing()


class _ChessboardFinder:
    def __init__(self, board: Board) -> None:
        self._size = board.cols, board.rows

    def find(self, picture: Picture) -> Found:
        grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
        flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_ACCURACY
        there, corners = cv2.findChessboardCornersSB(grey, self._size, flags=flags)
        if not there:
            return _nothing()
        return np.arange(self._size[0] * self._size[1]), corners.reshape(-1, 2).astype(np.float64)


def _same_way_up(found: Mapping[Position, Found]) -> dict[Position, Found]:
    """Chessboards look the same turned by half: cameras that look the same way agree about it."""
    turned, first = {}, None
    for at, (numbers, places) in found.items():
        if len(numbers):
            along = places[-1] - places[0]
            first = along if first is None else first
            turned[at] = numbers, places[::-1] if along @ first < 0 else places
        else:
            turned[at] = numbers, places
    return turned


def _nothing() -> Found:
    return np.empty(0, np.int64), np.empty((0, 2))


def _dictionary(name: str) -> cv2.aruco.Dictionary:
    return cv2.aruco.getPredefinedDictionary(int(getattr(cv2.aruco, f"DICT_{name}")))


def _length_m(text: str, length: str) -> float:
    match = _LENGTH.fullmatch(length)
    value = float(match[1]) * _METRES[match[2]] if match else 0.0
    if not value > 0:
        raise SettingError("board", f"the length {length} in {text!r}", "such as 25mm, 2.5cm or 0.025m")
    return value
