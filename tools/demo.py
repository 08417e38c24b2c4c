"""The main job, end to end: an array of views -> one file with its corner cameras -> all its views again.

    python tools/demo.py [--input FOLDER] [--out demo] [--qp 27] [--picture FILE.png]

Begins with one synthesised view, first_view.png, of the ready sample (or of FOLDER's first frame set). Then
renders the sample scene (or takes FOLDER), encodes the corner cameras and their disparity, decodes,
synthesises every view, measures each against its original, and codes the full array as simulcast H.264 at
the same QP for comparison. Leaves in OUT: array.mcap, mosaic.mp4, contact_sheet.png, and one virtual view as
original_synthesised_error.png.
"""

from __future__ import annotations

import argparse
import math
import shlex
import sys
import warnings
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import mvcodec
from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.capture import ArraySource, open_input
from mvcodec.cli.main import main as run_command
from mvcodec.cli.progress import progress
from mvcodec.container import StreamInfo, read_info
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import EncoderConfig, default_gop
from mvcodec.errors import MvCodecError, MvCodecWarning, SettingError
from mvcodec.evaluation.anchors import CodedArray, code_array
from mvcodec.evaluation.metrics import psnr
from mvcodec.evaluation.quality import Comparison, QualityMeter
from mvcodec.frames import DecodedSet, FrameSet, Picture
from mvcodec.output.mosaic import contact_sheet, error_picture, mosaic
from mvcodec.output.pictures import write_png
from mvcodec.output.scene_folder import write_sample
from mvcodec.output.video_file import Mp4Writer
from mvcodec.scenes.scene import SceneSettings
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.synthesis.synthesizers import make_synthesizer
from mvcodec.video.codec import RateControl
from mvcodec.workers import thread_count

FRAMES = 8
"""Of the sample scene: a third of a second, so that the whole takes less than two minutes on two cores."""

READY = Path(__file__).resolve().parents[1] / "samples" / "room_2x2.mcap"


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """One frame set for the pictures: what was there and what was synthesised."""

    originals: FrameSet
    pictures: Mapping[Position, Picture]


def main() -> int:
    """Parse, run, print the table."""
    parser = argparse.ArgumentParser(description="The main job of mvcodec on one array.")
    parser.add_argument(
        "--input", type=Path, metavar="FOLDER", help="array folder (default: the sample scene)"
    )
    parser.add_argument("--out", type=Path, default=Path("demo"), metavar="FOLDER")
    parser.add_argument(
        "--qp", type=int, default=27, metavar="N", help="of both codings (default: %(default)s)"
    )
    parser.add_argument("--synthesizer", default="layered", metavar="NAME")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="one more copy of the compared view")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore", MvCodecWarning)  # the encode command has said it
    try:
        return run(arguments)
    except MvCodecError as error:
        print(f"demo: {error}", file=sys.stderr)
        return 2 if isinstance(error, SettingError) else 1
    except KeyboardInterrupt:
        print("demo: interrupted", file=sys.stderr)
        return 1


def run(arguments: argparse.Namespace) -> int:
    """The steps; the same commands as a user would type, where there is one."""
    out: Path = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    coded = out / "array.mcap"
    if code := first_look(arguments.input, coded, out / "first_view.png", arguments.synthesizer):
        return code
    folder = arguments.input or out / "original"
    if arguments.input is None:
        render_sample(folder)
    if code := command("encode", folder, coded, "--qp", arguments.qp, "-y"):
        return code
    source, info = open_input([folder]), read_info(coded)
    synthesizer = make_synthesizer(arguments.synthesizer)
    quality, shown = decode_and_measure(source, coded, synthesizer, out / "mosaic.mp4")
    write_png(out / "contact_sheet.png", sheet(source.array, shown))
    for path in filter(None, (out / "original_synthesised_error.png", arguments.picture)):
        write_compared_view(source.array, shown, path)
    anchor = code_anchor(source, arguments.qp, info.header.settings.get("keyframe_ratio"))
    print(table(info, quality, anchor, arguments.qp))
    print("\nIn " + str(out) + ": " + ", ".join(sorted(path.name for path in out.iterdir())))
    print("\nNext, look around in it, and make a film of a moving viewpoint:\n")
    for next_command in next_commands(out, coded):
        print("   ", next_command)
    return 0


def first_look(folder: Path | None, coded: Path, picture: Path, synthesizer: str) -> int:
    """One view from between the cameras, before everything that takes longer; returns an exit code."""
    print("compiling, if this is the first time, and synthesising a first view", flush=True)
    file = READY
    if folder is not None:
        file = coded
        if code := command("encode", folder, coded, "--frames", ":1", "-y"):
            return code
    with mvcodec.open(file, synthesizer=synthesizer) as video:
        array = video.array
        # A quarter of the way, so that it is no camera's own place where there are three in a row.
        write_png(picture, video.render((array.rows - 1) / 4, (array.cols - 1) / 4, frame=0))
    print(f"a view that no camera saw: {picture}", flush=True)
    return 0


def next_commands(out: Path, coded: Path) -> tuple[str, str]:
    """What to type next, with the path of the command that is installed beside this Python."""
    program = Path(sys.executable).with_name("mvcodec")
    with suppress(ValueError):
        program = program.relative_to(Path.cwd())
    render = [program, "render", coded, out / "round.mp4", "--path", "circle", "-y"]
    return tuple(shlex.join(map(str, words)) for words in ([program, "play", coded], render))  # type: ignore[return-value]


def render_sample(folder: Path) -> None:
    """What ``mvcodec sample`` does, but without the exact disparity, which nothing here looks at."""
    print(f"rendering the sample scene into {folder}", flush=True)
    settings = SceneSettings(frames=FRAMES)
    with progress("render", FRAMES) as bar:
        write_sample(folder, settings=settings, progress=lambda _done, _of: bar.update(), with_truth=False)


def command(*arguments: object) -> int:
    """Run a command of the command line, and show it."""
    words = [str(argument) for argument in arguments]
    print("$ mvcodec", " ".join(words), flush=True)
    return run_command(words)


def decode_and_measure(
    source: ArraySource, coded: Path, synthesizer: Synthesizer, video: Path
) -> tuple[Comparison, Shown]:
    """Synthesise every view of every frame set on all cores, measure it, write the mosaic.

    Returns:
        The figures over all frame sets, and the frame set in the middle.
    """
    array, shown = source.array, None
    meter = QualityMeter(array.real)
    print(f"synthesising {len(array.positions)} views of {source.frame_count} frame sets", flush=True)
    with (
        Decoder.open(coded) as decoder,
        ExitStack() as outputs,
        ThreadPoolExecutor(thread_count()) as pool,
        progress("synthesise", source.frame_count) as bar,
    ):
        writer = None
        pairs = zip(source.frame_sets(views=array.positions), decoder, strict=True)
        for number, (originals, decoded) in enumerate(pairs):
            render = partial(render_and_measure, synthesizer, meter, originals, decoded)
            pictures = dict(zip(array.positions, pool.map(render, array.positions), strict=True))
            tiles = mosaic(rows_of(array, pictures))
            if writer is None:
                writer = outputs.enter_context(Mp4Writer(video, tiles.shape[1], tiles.shape[0], array.fps))
            writer.push(tiles)
            if number == source.frame_count // 2:
                shown = Shown(originals, pictures)
            bar.update()
    assert shown is not None
    return meter.result(), shown


def render_and_measure(
    synthesizer: Synthesizer, meter: QualityMeter, originals: FrameSet, decoded: DecodedSet, view: Position
) -> Picture:
    """One view of one frame set."""
    picture = synthesizer.render(decoded, Viewpoint(*view)).pixels
    meter.push(view, originals.pictures[view], picture)
    return picture


def rows_of(array: CameraArray, pictures: Mapping[Position, Picture]) -> list[list[Picture]]:
    """The pictures as they stand in the grid."""
    return [[pictures[row, col] for col in range(array.cols)] for row in range(array.rows)]


def sheet(array: CameraArray, shown: Shown) -> Picture:
    """All views with their names and PSNR."""

    def label(view: Position) -> str:
        decibel = psnr(shown.originals.pictures[view], shown.pictures[view])
        kind = "coded" if view in array.real else "synthesised"
        return f"{view[0]},{view[1]}  {kind}  {decibel:.1f} dB"

    labels = [[label((row, col)) for col in range(array.cols)] for row in range(array.rows)]
    return contact_sheet(rows_of(array, shown.pictures), labels)


def write_compared_view(array: CameraArray, shown: Shown, path: Path) -> None:
    """Original, synthesised and error picture of the virtual view farthest from the real cameras."""

    def distance(view: Position) -> float:
        return min(math.dist(view, camera) for camera in array.real)

    view = max(array.positions, key=distance)
    if view in array.real:
        print("every view is real: no synthesised picture to show beside its original")
        return
    write_png(path, error_picture(shown.originals.pictures[view], shown.pictures[view]))


def code_anchor(source: ArraySource, qp: int, keyframe_ratio: float | None) -> CodedArray:
    """The full array as simulcast H.264."""
    count = 2 * source.frame_count * len(source.array.positions)  # each is coded and measured
    print(f"coding all {len(source.array.positions)} views as simulcast H.264", flush=True)
    with progress("simulcast", count, unit="picture") as bar:
        return code_array(
            source,
            rate=RateControl(qp=qp),
            gop=default_gop(source.array.fps),
            preset=EncoderConfig().chosen_preset,
            keyframe_ratio=keyframe_ratio,
            on_picture=bar.update,
        )


def table(info: StreamInfo, quality: Comparison, anchor: CodedArray, qp: int) -> str:
    """Bits and quality of both, side by side."""
    seconds = info.frames / info.header.array.fps
    streams = f"{len(info.header.array.real)} + {len(info.header.map_cameras)} maps"
    lines = [
        "",
        f"{info.frames} frame sets at QP {qp}     {'mvcodec file':>14} {'full simulcast':>15}",
        f"{'streams':24} {streams:>14} {len(anchor.quality.views):15}",
        f"{'kbit':24} {info.bits.total / 1e3:14.1f} {anchor.bits / 1e3:15.1f}",
        f"{'kbit/s':24} {info.bits.total / seconds / 1e3:14.1f} {anchor.bits / seconds / 1e3:15.1f}",
    ]
    for name, ours, theirs in (
        ("Y-PSNR dB", quality.psnr_y, anchor.quality.psnr_y),
        ("SSIM", quality.ssim, anchor.quality.ssim),
    ):
        digits = 2 if name.endswith("dB") else 4
        for kind, value in ours.to_json().items():
            figures = value, theirs.to_json()[kind]
            cells = ["-" if number is None else f"{number:.{digits}f}" for number in figures]
            lines.append(f"{f'{name}, {kind}':24} {cells[0]:>14} {cells[1]:>15}")
    share = info.bits.total / anchor.bits
    lines.append(f"bits: {share:.1%} of the simulcast's (file with its container, simulcast without)")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
