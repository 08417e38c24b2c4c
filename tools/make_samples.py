"""Makes what lies in samples/: the scene `room` as 2 x 2 H.264 files with their array.json.

    python tools/make_samples.py [FOLDER]

The same versions of the libraries make the same files.
"""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from pathlib import Path

from mvcodec.array import Viewpoint
from mvcodec.output.array_folder import VIDEO_PATTERN, ArrayFacts, write_manifest
from mvcodec.output.video_file import Mp4Writer
from mvcodec.scenes.scene import SceneSettings, make_scene

ROWS, COLS, FRAMES, SIZE = 2, 2, 12, (640, 360)
CRF = 8.0
DEFAULT_FOLDER = Path(__file__).resolve().parents[1] / "samples" / "room_2x2"


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


def main() -> None:
    """Parse the command line and make the samples."""
    parser = argparse.ArgumentParser(description="Make the sample array in samples/.")
    parser.add_argument("folder", type=Path, nargs="?", default=DEFAULT_FOLDER)
    folder = parser.parse_args().folder
    make_room(folder)
    print(f"{folder}: {sum(path.stat().st_size for path in folder.iterdir()) / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
