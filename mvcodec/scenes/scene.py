"""The sample scenes: `room`, rendered, `motorcycle`, a real pair, and still ones that are hard to match."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Protocol

import numpy as np

from mvcodec.array import MAX_GRID_SIDE, MAX_PICTURE_SIDE, Calibration, CameraArray, Position, Viewpoint
from mvcodec.errors import SettingError
from mvcodec.frames import FloatMap, Picture
from mvcodec.scenes.difficult import ARRANGEMENTS, DifficultScene
from mvcodec.scenes.difficult import SIZE as DIFFICULT_SIZE
from mvcodec.scenes.lighting import LightBaker
from mvcodec.scenes.renderer import LitScene, Matrix, Optics
from mvcodec.scenes.room import FLOOR_FROM_M, FLOOR_M, LIGHTING, NEAREST_M, WALL_M, Room
from mvcodec.scenes.solids import Vector
from mvcodec.scenes.textures import photographs
from mvcodec.settings import check_settings, setting, show

ROOM_FPS = 24.0
# Of the whole rig, whatever its grid: 20 px of disparity between its ends at the wall, at a width of 640.
ROOM_SPAN_M = 0.1875
MAX_FRAMES = 100_000
_ROOM_GRID, _ROOM_FRAMES, _ROOM_SIZE = (5, 5), 24, (640, 360)
_MIN_SIDE = 16
_TALLEST = 4
_LIT_FRAMES = 2


@dataclass(frozen=True, slots=True)
class SceneSettings:
    """What is asked of a scene; None takes the scene's own. Each is explained by its field.

    Raises:
        SettingError: a value is outside its range.
    """

    grid: tuple[int, int] | None = setting(
        None,
        f"(rows, cols) of views (default: {show(_ROOM_GRID)}, of other scenes than room their own)",
        low=1,
        high=MAX_GRID_SIDE,
        expected=f"RxC, each 1..{MAX_GRID_SIDE}",
    )
    frames: int | None = setting(
        None, f"how many (default: {_ROOM_FRAMES}, where nothing moves 1)", low=1, high=MAX_FRAMES
    )
    size: tuple[int, int] | None = setting(
        None,
        f"(width, height) of the pictures, px (default: {show(_ROOM_SIZE)}, of other scenes their own)",
        low=_MIN_SIDE,
        high=MAX_PICTURE_SIDE,
        expected=f"WxH px, each {_MIN_SIDE}..{MAX_PICTURE_SIDE}",
    )
    seed: int = setting(0, "of what a scene leaves to chance", low=0)

    def __post_init__(self) -> None:
        check_settings(self)


class Scene(Protocol):
    """A scene that can be seen from every position of its array.

    Attributes:
        array: the geometry; its corners count as real.
        frame_count: how many frames it has.
        licence: of the pictures; one line.
    """

    @property
    def array(self) -> CameraArray: ...

    @property
    def frame_count(self) -> int: ...

    @property
    def licence(self) -> str: ...

    def render(self, viewpoint: Viewpoint, frame: int) -> tuple[Picture, FloatMap | None]:
        """One view at one time. May be called from several threads.

        Returns:
            uint8 (H, W, 3) RGB, and the exact disparity of each pixel's centre: float32 (H, W),
            px for ONE GRID STEP (sign: ALGORITHMS 0), NaN where unknown; None where all is.

        Raises:
            SettingError: no such viewpoint or frame.
        """
        ...


class RoomScene:
    """A rendered room with moving objects: a rolling ball, a pendulum, a turning crate.

    The cameras stand in one plane, parallel, in square steps, and the rig's longer side is always
    as long, whatever the grid: about 20..60 px of disparity between its ends at a width of 640.

    Raises:
        SettingError: a picture more than 4 times as high as wide.
    """

    licence = "Rendered by mvcodec; photographs from scikit-image (CC0 and public domain)"

    def __init__(self, settings: SceneSettings) -> None:
        rows, cols = settings.grid or _ROOM_GRID
        width, height = settings.size or _ROOM_SIZE
        if height > _TALLEST * width:
            # Beyond that the pictures would show where wall and floor end.
            raise SettingError("size", show((width, height)), f"at most {_TALLEST} times as high as wide")
        self.frame_count = settings.frames or _ROOM_FRAMES
        self._step_m = ROOM_SPAN_M / max(rows - 1, cols - 1, 1)
        self._optics = Optics(width, height, float(width))
        cx, cy = self._optics.centre_px
        # In a tall picture the floor comes nearer than any object, down to where it begins.
        floor_m = (FLOOR_M - ROOM_SPAN_M / 2) / (height / 2 / width)
        nearest_m = max(min(NEAREST_M, floor_m), FLOOR_FROM_M)
        near, far = (width * self._step_m / depth for depth in (nearest_m, WALL_M))
        self.array = CameraArray(
            rows=rows,
            cols=cols,
            width=width,
            height=height,
            fps=ROOM_FPS,
            real_rows=tuple(sorted({0, rows - 1})),
            real_cols=tuple(sorted({0, cols - 1})),
            calibration=Calibration(width, width, cx, cy, self._step_m),
            disparity_per_step_px=(0.9 * far, near),
            name="room",
        )
        self._room = Room.of_seed(settings.seed)
        self._standing = self._room.standing()
        self._lit: dict[int, LitScene] = {}
        self._lock = threading.Lock()

    def render(self, viewpoint: Viewpoint, frame: int) -> tuple[Picture, FloatMap]:
        """See Scene; any viewpoint within the grid."""
        self.array.check_viewpoint(viewpoint)
        _check_frame(frame, self.frame_count)
        right = (viewpoint.col - (self.array.cols - 1) / 2) * self._step_m
        down = (viewpoint.row - (self.array.rows - 1) / 2) * self._step_m
        picture, inverse_depth = self._at(frame).render(self._optics, (right, down, 0.0))
        scale = np.float32(self._optics.focal_px * self._step_m)
        return picture, inverse_depth * scale

    def look(
        self,
        place_steps: Vector,
        frame: int,
        optics: Optics | None = None,
        turn: Matrix | None = None,
        gain: float = 1.0,
    ) -> tuple[Picture, FloatMap]:
        """The room from any camera, which need not be one of the array's.

        Args:
            place_steps: (x, y, z) in steps of the grid from view (0, 0); x right, y down, z forward.
            frame: may lie before the first one.
            optics, turn, gain: as in LitScene.render; None: those of the array's cameras.

        Returns:
            uint8 (H, W, 3) RGB, and float32 (H, W): 1/Z of each pixel's centre in the camera's axes, 1/m.
        """
        x, y, z = place_steps
        right = (x - (self.array.cols - 1) / 2) * self._step_m
        down = (y - (self.array.rows - 1) / 2) * self._step_m
        return self._at(frame).render(optics or self._optics, (right, down, z * self._step_m), turn, gain)

    def _at(self, frame: int) -> LitScene:
        """The scene at a frame, lit; kept until others are asked for: late cameras see the one before."""
        with self._lock:
            if frame not in self._lit:
                while len(self._lit) >= _LIT_FRAMES:
                    del self._lit[min(self._lit)]
                moving = self._room.moving(frame / ROOM_FPS)
                self._lit[frame] = LitScene([*self._standing, *moving], _baker(self._room).bake(moving))
            return self._lit[frame]


@lru_cache(maxsize=4)
def _baker(room: Room) -> LightBaker:
    """What stands still lights itself once, however many grids and sizes look at it."""
    return LightBaker(room.standing(), LIGHTING)


class MotorcycleScene:
    """The real stereo pair in scikit-image (Middlebury 2014 "Motorcycle", a quarter of its size).

    Its truth belongs to the left view. Focal length, baseline and the offset of the principal
    points are those in scikit-image's documentation.

    Raises:
        SettingError: another grid, size or number of frames than the pair has.
    """

    licence = "Middlebury 2014 stereo data (Scharstein et al., GCPR 2014), as in scikit-image"

    def __init__(self, settings: SceneSettings) -> None:
        load: Callable[[], tuple[Picture, Picture, FloatMap]] = photographs().stereo_motorcycle
        left, right, disparity = load()
        self.frame_count = 1
        self._pictures: dict[Position, Picture] = {(0, 0): left, (0, 1): right}
        self._disparity = np.where(np.isfinite(disparity), disparity, np.nan).astype(np.float32)
        height, width = left.shape[:2]
        for option, found, only in (
            ("grid", settings.grid, (1, 2)),
            ("size", settings.size, (width, height)),
        ):
            if found not in (None, only):
                raise SettingError(
                    option, show(found), f"{show(only)}, the real pair of the scene motorcycle"
                )
        if settings.frames not in (None, 1):
            raise SettingError("frames", settings.frames, "1, the real pair of the scene motorcycle")
        known = self._disparity[np.isfinite(self._disparity)]
        self.array = CameraArray(
            rows=1,
            cols=2,
            width=width,
            height=height,
            fps=15.0,
            real_rows=(0,),
            real_cols=(0, 1),
            calibration=Calibration(994.978, 994.978, 311.193, 254.877, 0.193001, -31.086),
            disparity_per_step_px=(float(np.floor(known.min())), float(np.ceil(known.max()))),
            name="motorcycle",
        )

    def render(self, viewpoint: Viewpoint, frame: int) -> tuple[Picture, FloatMap | None]:
        """See Scene; the two real views only."""
        _check_frame(frame, self.frame_count)
        position = viewpoint.position
        if position not in self._pictures:
            raise SettingError("viewpoint", f"{viewpoint.row:g},{viewpoint.col:g}", "0,0 or 0,1")
        return self._pictures[position], self._disparity if position == (0, 0) else None


def _still(name: str, settings: SceneSettings) -> Scene:
    """A difficult scene.

    Raises:
        SettingError: more than one frame, as nothing moves.
    """
    if settings.frames not in (None, 1):
        raise SettingError("frames", settings.frames, f"1: nothing moves in the scene {name}")
    return DifficultScene(name, settings.grid, settings.size or DIFFICULT_SIZE, settings.seed)


SCENES: dict[str, Callable[[SceneSettings], Scene]] = {
    "room": RoomScene,
    "motorcycle": MotorcycleScene,
    **{name: partial(_still, name) for name in ARRANGEMENTS},
}
DEFAULT_SCENE = "room"


def make_scene(name: str, settings: SceneSettings | None = None) -> Scene:
    """A scene by name.

    Raises:
        SettingError: no such scene, or settings that it can't take.
    """
    if name not in SCENES:
        raise SettingError("scene", name, " | ".join(SCENES))
    return SCENES[name](settings or SceneSettings())


def _check_frame(frame: int, count: int) -> None:
    if not 0 <= frame < count:
        raise SettingError("frame", frame, f"0..{count - 1}")
