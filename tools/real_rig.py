"""Measures `rectify` on a real rig of known calibration: by its files, by the scene, and their depth."""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import Position
from mvcodec.capture import ArraySource, open_input
from mvcodec.frames import Picture
from mvcodec.output.pictures import write_png
from mvcodec.rigs.calibration import Calibrated, calibrate_from_files, calibrate_from_scene
from mvcodec.rigs.features import find_tracks
from mvcodec.rigs.remap import RectifiedSource, Rectifier
from mvcodec.rigs.residuals import Residuals, rays, residuals_of
from mvcodec.stereo.disparity_range import estimate_range
from mvcodec.stereo.matchers import make_base_matcher

Vectors = NDArray[np.float64]


def opened(folders: list[Path], beside: Path) -> ArraySource:
    """One row of cameras, a folder of pictures each, of the same times in the order of their names."""
    names = [[str(path.resolve()) for path in sorted(folder.glob("*.png"))] for folder in folders]
    manifest = beside / "array.json"
    manifest.write_text(json.dumps({"rows": 1, "cols": len(folders), "fps": 20, "views": [names]}))
    return open_input(manifest, real="all")


def rectified_residuals(found: Calibrated, source: ArraySource, numbers: list[int]) -> Residuals:
    """Of new matches in the rectified pictures, whatever calibration found."""
    straight = RectifiedSource(source, Rectifier(found.rig))
    sets = [frame for number in numbers for frame in straight.frame_sets(slice(number, number + 1))]
    tracks, _ = find_tracks(sets, straight.array.positions)
    return residuals_of(tracks, straight.array.rho)


def ranges(found: Calibrated, source: ArraySource, number: int, pixels: Vectors, at: Position) -> Vectors:
    """(N,): how far away what pixels (N, 2) of a camera show is, in steps of the rig; NaN: not known."""
    rig = found.rig
    straight = RectifiedSource(source, Rectifier(rig))
    (frame_set,) = straight.frame_sets(slice(number, number + 1))
    array = straight.array
    reach = estimate_range(array, [frame_set])
    maps = make_base_matcher("joint").match(array, frame_set.pictures, reach)
    values = maps[at].values_px
    camera, view = rig.cameras[at], rig.rectified
    slopes = rays(camera.lens, pixels)
    turned = np.column_stack([slopes, np.ones(len(slopes))]) @ camera.turn
    ray = turned[:, :2] / turned[:, 2:]
    places = (ray * view.focal_px + view.centre_px).astype(np.float32)
    disparity = cv2.remap(values, places[:, 0], places[:, 1], cv2.INTER_NEAREST, borderValue=np.nan).ravel()
    depth = np.where(disparity > 0.5, view.focal_px / disparity, np.nan)
    return np.asarray(depth * np.hypot(1, np.hypot(ray[:, 0], ray[:, 1])))


def compared(
    one: Calibrated, other: Calibrated, source: ArraySource, number: int
) -> tuple[float, float, float, float]:
    """How far the first camera's distances by two calibrations are apart.

    Returns:
        The median share that they differ by, the median ratio, the median share once that is taken out, and
        the share of the pixels of which both say something.
    """
    x, y = np.meshgrid(np.arange(0, source.array.width, 4.0), np.arange(0, source.array.height, 4.0))
    pixels = np.column_stack([x.ravel(), y.ravel()])
    ratios = ranges(other, source, number, pixels, (0, 0)) / ranges(one, source, number, pixels, (0, 0))
    known = np.isfinite(ratios)
    ratio = float(np.median(ratios[known]))
    apart, alike = (float(np.median(np.abs(ratios[known] / by - 1))) for by in (1.0, ratio))
    return apart, ratio, alike, float(known.mean())


def side_by_side(pictures: list[Picture]) -> Picture:
    """With lines across, along which rows must agree."""
    beside = np.concatenate(pictures, axis=1)
    for y in range(20, beside.shape[0], 40):
        beside[y] = (255, 160, 0)
    return beside


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cameras", type=Path, nargs="+", required=True, help="a folder of pictures each")
    parser.add_argument("--calibration", type=Path, nargs="+", required=True)
    parser.add_argument("--frame", type=int, default=12, help="whose depth is compared")
    parser.add_argument("--pictures", type=Path, help="a folder for pictures of before and after")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        source = opened(arguments.cameras, Path(folder))
        chosen = range(source.frame_count)
        found = {
            "file": calibrate_from_files(source, chosen, arguments.calibration),
            "scene": calibrate_from_scene(source, chosen),
        }
        _tell(found, source, arguments)


def _tell(found: dict[str, Calibrated], source: ArraySource, arguments: argparse.Namespace) -> None:
    new = [number for number in (2, 8, 14, 20) if number < source.frame_count]
    for way, calibrated in found.items():
        residuals = rectified_residuals(calibrated, source, new)
        focal = [round(camera.lens.focal_px[0], 1) for camera in calibrated.rig.cameras.values()]
        print(f"from {way}: rows {residuals.rows.text()}, focal lengths {focal} px, {calibrated.summary()}")
    apart, ratio, alike, known = compared(found["file"], found["scene"], source, arguments.frame)
    print(
        f"ranges: median {apart:.2%} apart, ratio {ratio:.4f}, {alike:.2%} apart but for that, {known:.0%} of"
        " the pixels"
    )
    if arguments.pictures is not None:
        _write(found, source, arguments)


def _write(found: dict[str, Calibrated], source: ArraySource, arguments: argparse.Namespace) -> None:
    arguments.pictures.mkdir(parents=True, exist_ok=True)
    sources: dict[str, ArraySource] = {"before": source}
    sources |= {way: RectifiedSource(source, Rectifier(each.rig)) for way, each in found.items()}
    for name, each in sources.items():
        (frame_set,) = each.frame_sets(slice(arguments.frame, arguments.frame + 1))
        pictures = [frame_set.pictures[at] for at in each.array.positions]
        write_png(arguments.pictures / f"{name}.png", side_by_side(pictures))


if __name__ == "__main__":
    main()
