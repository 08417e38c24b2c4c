"""Measures `rectify` on rough sample rigs: angles, residuals, virtual views against rendered truth, time."""

from __future__ import annotations

import argparse
import json
import resource
import tempfile
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import mvcodec
from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.capture import resolve_frames
from mvcodec.capture.sync import motion_of
from mvcodec.capture.sync_views import offsets_by_motion
from mvcodec.evaluation.metrics import psnr
from mvcodec.frames import DisparityMap, FrameSet, Picture
from mvcodec.kernels.raycast import straightened
from mvcodec.rigs.calibration import Calibrated, calibrate_from_scene
from mvcodec.rigs.features import find_tracks
from mvcodec.rigs.remap import RectifiedSource, Rectifier, source_places
from mvcodec.rigs.residuals import Spread, residuals_of
from mvcodec.rigs.rig import Rig
from mvcodec.scenes.renderer import Optics
from mvcodec.scenes.rough_rig import FLAWS, RoughCamera, RoughRigSettings, RoughScene
from mvcodec.scenes.scene import RoomScene, SceneSettings

Vectors = NDArray[np.float64]
FRAMES = 3
MOVING_FRAMES, STEP_NS = 12, 33_333_333
"""What `--sync` looks at, as `mvcodec rectify --sync motion` would."""
VIEWS = {(2, 2): ((0.5, 0.5), (0.5, 0.0), (0.0, 0.5)), (3, 3): ((0.5, 0.5), (1.5, 0.5), (1.0, 1.5))}
"""Virtual views that are looked at, in steps of each grid."""


class SceneSource:
    """An ArraySource over a scene, all of whose cameras are real. Each frame is rendered once.

    `late` says how many pictures of which cameras are left out at the beginning.
    """

    first_frame = 0
    listed_real = None
    has_given = False

    def __init__(self, scene: RoomScene | RoughScene, late: Mapping[Position, int] | None = None) -> None:
        rows, cols = tuple(range(scene.array.rows)), tuple(range(scene.array.cols))
        self.array: CameraArray = replace(scene.array, real_rows=rows, real_cols=cols)
        self.name, self.frame_count = scene.array.name, scene.frame_count
        self._scene, self._late = scene, dict(late or {})
        self._rendered: dict[tuple[Position, int], Picture] = {}

    def frame_sets(
        self, frames: slice | None = None, views: Collection[Position] | None = None
    ) -> Iterator[FrameSet]:
        """See ArraySource."""
        for frame in resolve_frames(frames, self.frame_count, self.name):
            yield FrameSet(
                frame, frame, {view: self._picture(view, frame) for view in views or self.array.real}
            )

    def truth(self, view: Position, frame: int) -> DisparityMap | None:
        """See ArraySource."""
        del view, frame
        return None

    def _picture(self, view: Position, frame: int) -> Picture:
        if (view, frame) not in self._rendered:
            self._rendered[view, frame] = self._shown(view, frame)
        return self._rendered[view, frame]

    def _shown(self, view: Position, frame: int) -> Picture:
        return self._scene.render(Viewpoint(*view), frame + self._late.get(view, 0))[0]


@dataclass(frozen=True, slots=True)
class Measured:
    """Of one rough rig.

    Attributes:
        angle_deg: median error of the cameras' directions, up to one common rotation.
        rows, columns: residuals of new matches in the rectified pictures.
        views_db, ideal_db: mean luma PSNR of virtual views against rendered truth, and the ideal rig's.
        in_place_db: the same of ideal cameras in the place of the rectified ones: of what is left of the
            scene, at the rectified pictures' scale.
        cpu_s: of finding the rig, all threads.
    """

    seed: int
    grid: str
    angle_deg: float
    rows: Spread
    columns: Spread
    views_db: float
    ideal_db: float
    in_place_db: float
    cpu_s: float


def angle_errors_deg(rig: Rig, truth: Mapping[Position, RoughCamera]) -> Vectors:
    """(N,): how far each camera's direction is off, once one rotation of all is taken out."""
    found = Rotation.from_matrix([camera.turn for camera in rig.cameras.values()])
    true = Rotation.from_matrix([truth[at].turn for at in rig.cameras])
    common = (found.inv() * true).mean()
    return np.asarray(np.degrees((found * common * true.inv()).magnitude()))


def late_by_motion(scene: RoughScene) -> dict[Position, int]:
    """How many frames each camera is later than most, by what moves."""
    times = [number * STEP_NS for number in range(MOVING_FRAMES)]
    cameras = scene.array.positions
    motions = {
        at: motion_of((scene.render(Viewpoint(*at), n)[0] for n in range(MOVING_FRAMES)), times)
        for at in cameras
    }
    offsets = offsets_by_motion(motions, dict.fromkeys(cameras, times), {at: str(at) for at in cameras})
    late = {at: -round(offset / STEP_NS) for at, offset in offsets.items()}
    usual = Counter(late.values()).most_common(1)[0][0]
    return {at: frames - usual for at, frames in late.items()}


def measure(
    seed: int, grid: tuple[int, int], flaws: tuple[str, ...], ideal_db: float, *, sync: bool = False
) -> Measured:
    """One rough rig; with `sync`, cameras are put in step first."""
    scene = RoughScene.of(SceneSettings(grid, FRAMES), RoughRigSettings(seed, flaws))
    source = SceneSource(scene, late_by_motion(scene) if sync else None)
    list(source.frame_sets())
    before = resource.getrusage(resource.RUSAGE_SELF)
    found = calibrate_from_scene(source, range(FRAMES))
    after = resource.getrusage(resource.RUSAGE_SELF)
    straight = RectifiedSource(source, Rectifier(found.rig))
    tracks, _ = find_tracks(list(straight.frame_sets(slice(1, 2))), straight.array.positions)
    residuals = residuals_of(tracks, straight.array.rho)
    views_db, in_place_db = _views_db(straight, scene, found)
    return Measured(
        seed,
        f"{grid[0]}x{grid[1]}",
        float(np.median(angle_errors_deg(found.rig, scene.cameras))),
        residuals.rows,
        residuals.columns,
        views_db,
        ideal_db,
        in_place_db,
        after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
    )


def ideal_db(grid: tuple[int, int]) -> float:
    """Mean luma PSNR of the virtual views of the ideal rig."""
    room = RoomScene(SceneSettings(grid, FRAMES))
    truths = {viewpoint: room.render(viewpoint, 1)[0] for viewpoint in _viewpoints(grid)}
    source = SceneSource(room)
    (frame_set,) = source.frame_sets(slice(1, 2))
    return _coded_db(source.array, frame_set.pictures, truths)


def _views_db(straight: RectifiedSource, scene: RoughScene, found: Calibrated) -> tuple[float, float]:
    """`views_db` and `in_place_db`."""
    optics, turn = true_rectified_camera(found.rig, scene)

    def seen(row: float, col: float) -> Picture:
        return scene.room.look((col, row, 0.0), 1, optics, turn)[0]

    truths = {at: seen(at.row, at.col) for at in _viewpoints((scene.array.rows, scene.array.cols))}
    (frame_set,) = straight.frame_sets(slice(1, 2))
    in_place = {(row, col): seen(row, col) for row, col in straight.array.positions}
    return (
        _coded_db(straight.array, frame_set.pictures, truths),
        _coded_db(straight.array, in_place, truths),
    )


def _coded_db(
    array: CameraArray, pictures: Mapping[Position, Picture], truths: Mapping[Viewpoint, Picture]
) -> float:
    """Mean luma PSNR of views of one frame set, coded as `mvcodec encode` does by default."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rig.mcap"
        mvcodec.encode([pictures], path, calibration=array.calibration, rho=array.rho)
        with mvcodec.open(path) as video:
            views = {at: video.render(at.row, at.col) for at in truths}
    return float(np.mean([_registered_db(truths[at], views[at]) for at in truths]))


def _registered_db(truth: Picture, view: Picture) -> float:
    """Luma PSNR once the best homography (Evangelidis and Psarakis 2008) and gain are taken out.

    The view is brought to the truth's brightness: errors of brighter pictures would count more.
    """
    one, other = (cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY) for picture in (view, truth))
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 60, 1e-7)
    start = np.eye(3, dtype=np.float32)
    _, warp = cv2.findTransformECC(one, other, start, cv2.MOTION_HOMOGRAPHY, criteria)
    size = (view.shape[1], view.shape[0])
    flags = cv2.INTER_LANCZOS4 | cv2.WARP_INVERSE_MAP
    moved = cv2.warpPerspective(truth, warp, size, flags=flags, borderMode=cv2.BORDER_REFLECT)
    inside = cv2.warpPerspective(np.full_like(other, 255), warp, size, flags=cv2.WARP_INVERSE_MAP) == 255
    gain = float((moved.astype(float) * view).sum() / (moved.astype(float) ** 2).sum())
    lit = np.clip(np.rint(view / gain), 0, 255).astype(np.uint8)
    return psnr(np.where(inside[..., None], moved, lit), lit)


def true_rectified_camera(rig: Rig, scene: RoughScene) -> tuple[Optics, Vectors]:
    """The camera of the room that sees what the rectified pictures show: best over all cameras."""
    view = rig.rectified
    y, x = np.mgrid[0 : view.height : 40j, 0 : view.width : 60j]
    pixels = np.column_stack([x.ravel(), y.ravel()])
    directions = []
    focal = scene.array.width
    centre = ((scene.array.width - 1) / 2, (scene.array.height - 1) / 2)
    for at, camera in rig.cameras.items():
        true = scene.cameras[at]
        places = (source_places(camera, at, view, pixels) - centre) / (focal * true.focal_factor)
        bent = np.array([straightened(x, y, true.k1, 0.0) for x, y in places])
        directions.append(np.column_stack([bent, np.ones(len(bent))]) @ true.turn)

    def camera_of(values: Vectors) -> tuple[float, Vectors, Vectors]:
        return focal * np.exp(values[0]), values[1:3] * 100, Rotation.from_rotvec(values[3:]).as_matrix()

    def apart(values: Vectors) -> Vectors:
        focal_px, centre_px, turn = camera_of(values)
        found = []
        for direction in directions:
            seen = direction @ turn.T
            found.append(seen[:, :2] / seen[:, 2:] * focal_px + centre_px - pixels)
        return np.concatenate(found).ravel()

    start = np.array([0, *np.array(view.centre_px) / 100, 0, 0, 0])
    focal_px, centre_px, turn = camera_of(least_squares(apart, start, x_scale="jac").x)
    principal = float(centre_px[0]), float(centre_px[1])
    return Optics(view.width, view.height, float(focal_px), principal_px=principal), turn


def _viewpoints(grid: tuple[int, int]) -> list[Viewpoint]:
    return [Viewpoint(row, col) for row, col in VIEWS[grid]]


def main() -> None:
    """Print a table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--grids", nargs="+", default=["2x2", "3x3"])
    parser.add_argument("--flaws", nargs="+", default=list(FLAWS), choices=FLAWS)
    parser.add_argument("--sync", action="store_true", help="put cameras in step by what moves")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    rows: list[dict[str, Any]] = []
    for text in arguments.grids:
        grid = int(text.split("x")[0]), int(text.split("x")[1])
        best = ideal_db(grid)
        for seed in range(1, arguments.seeds + 1):
            measured = measure(seed, grid, tuple(arguments.flaws), best, sync=arguments.sync)
            rows.append(asdict(measured))
            if not arguments.json:
                print(
                    f"{text} seed {seed}: angles {measured.angle_deg:.3f} deg, rows {measured.rows.text()},"
                    f" columns {measured.columns.text()}, views {measured.views_db:.2f} dB"
                    f" (ideal {best:.2f}, ideal in place {measured.in_place_db:.2f}),"
                    f" {measured.cpu_s:.1f} s of CPU",
                    flush=True,
                )
    if arguments.json:
        print(json.dumps(rows, indent=2))


if __name__ == "__main__":
    main()
