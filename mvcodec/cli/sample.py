"""``mvcodec sample``: a sample scene as an array folder."""

from __future__ import annotations

import argparse

from mvcodec.cli.arguments import add_output_options, pair_of_sizes, picture_size
from mvcodec.cli.info import count
from mvcodec.cli.paths import ARRAY_NAMES, add_overwrite, check_folder_target, local_path
from mvcodec.cli.progress import progress
from mvcodec.cli.setting_options import add_setting
from mvcodec.output.scene_folder import make_sample, write_sample
from mvcodec.scenes.rough_rig import FLAWS, RoughRigSettings
from mvcodec.scenes.scene import DEFAULT_SCENE, SCENES, SceneSettings


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``sample``."""
    parser.add_argument("output", type=local_path, metavar="OUTDIR", help="the array folder to write")
    parser.add_argument(
        "--scene",
        default=DEFAULT_SCENE,
        metavar="NAME",
        help=f"one of {', '.join(SCENES)} (default: %(default)s)",
    )
    add_setting(parser, SceneSettings, "grid", parse=pair_of_sizes, metavar="RxC")
    add_setting(parser, SceneSettings, "frames")
    add_setting(parser, SceneSettings, "size", parse=picture_size, metavar="WxH", note=", or a word as 720p")
    add_setting(parser, SceneSettings, "seed")
    parser.add_argument(
        "--rig",
        metavar="rough[:SEED][,only=FLAW,...]",
        help="seen by imperfect cameras, with their exact truth in rig_truth.json; flaws:"
        f" {', '.join(FLAWS)} (default: all of them)",
    )
    add_overwrite(parser)
    add_output_options(parser)


def run(arguments: argparse.Namespace) -> None:
    """Render and write."""
    settings = SceneSettings(arguments.grid, arguments.frames, arguments.size, arguments.seed)
    rig = None if arguments.rig is None else RoughRigSettings.from_text(arguments.rig)
    frames = make_sample(arguments.scene, settings, rig).frame_count
    check_folder_target(arguments.output, ARRAY_NAMES, overwrite=arguments.overwrite)
    with progress("render", frames, quiet=arguments.quiet) as bar:
        scene = write_sample(
            arguments.output, arguments.scene, settings, lambda _done, _of: bar.update(), rig=rig
        )
    if not arguments.quiet:
        array = scene.array
        grid = f"{array.rows} x {array.cols} views of {array.width} x {array.height} px"
        print(f"{arguments.output}: {count(frames, 'frame')} of {grid}")
