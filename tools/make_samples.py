"""Makes what lies in samples/: the scene `room` as 2 x 2 H.264 files with their array.json, and coded.

    python tools/make_samples.py [FOLDER]

The same versions of the libraries make the same files.
"""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from pathlib import Path

from mvcodec import Encoder, EncoderConfig, McapWriter, Viewpoint, open_input
from mvcodec.output.array_folder import VIDEO_PATTERN, ArrayFacts, write_manifest
from mvcodec.output.video_file import Mp4Writer
from mvcodec.scenes.scene import SceneSettings, make_scene
from mvcodec.stereo.disparity_range import estimate_range

ROWS, COLS, FRAMES, SIZE = 2, 2, 12, (640, 360)
CRF = 8.0
QP = 27
"""Of the coded file."""

NAME = "room_2x2"
DEFAULT_FOLDER = Path(__file__).resolve().parents[1] / "samples"


def make_room(folder: Path) -> None:
    """Render the scene and write one video file a view.

    Raises:
        OutputError: the system refuses.
    """
    scene = make_scene("room", SceneSettings(grid=(ROWS, COLS), frames=FRAMES, size=SIZE))
    array = scene.array
    with ExitStack() as stack:
        writers = {
            (row, col): stack.enter_context(
                Mp4Writer(folder / VIDEO_PATTERN.format(row=row, col=col), *SIZE, array.fps, crf=CRF)
            )
            for row, col in array.positions
        }
        for frame in range(scene.frame_count):
            for view, writer in writers.items():
                writer.push(scene.render(Viewpoint(*view), frame)[0])
    facts = ArrayFacts.of(array, licence=scene.licence)
    write_manifest(folder, facts, {"pattern": VIDEO_PATTERN})


def code_room(folder: Path, coded: Path, frames: slice | None = None) -> None:
    """Code what `make_room` wrote, as ``mvcodec encode`` does; `frames` of it, or all.

    Raises:
        InputError: the folder is not there.
        OutputError: the system refuses.
    """
    source = open_input([folder])
    range_px = estimate_range(source.array, list(source.frame_sets(slice(1))), source.array.disparity_hint_px)
    config = EncoderConfig(qp=QP, disparity_range_px=range_px)
    with Encoder(source.array, config) as encoder, McapWriter(coded) as writer:
        for frame_set in source.frame_sets(frames):
            writer.push(encoder.push(frame_set))


def main() -> None:
    """Parse the command line and make the samples."""
    parser = argparse.ArgumentParser(description="Make the sample array in samples/, and its coded file.")
    parser.add_argument("folder", type=Path, nargs="?", default=DEFAULT_FOLDER)
    folder = parser.parse_args().folder
    room, coded = folder / NAME, folder / f"{NAME}.mcap"
    make_room(room)
    code_room(room, coded)
    print(f"{room}: {sum(path.stat().st_size for path in room.iterdir()) / 1e6:.2f} MB")
    print(f"{coded}: {coded.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
