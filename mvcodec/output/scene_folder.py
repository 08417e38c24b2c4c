"""Writes a sample scene as an array folder."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

from mvcodec.array import Position, Viewpoint
from mvcodec.errors import SettingError
from mvcodec.frames import FloatMap, Picture
from mvcodec.output.array_folder import ArrayFacts, ArrayFolderWriter
from mvcodec.output.atomic import write_bytes
from mvcodec.scenes.rough_rig import RoughRigSettings, RoughScene
from mvcodec.scenes.scene import DEFAULT_SCENE, Scene, SceneSettings, make_scene
from mvcodec.workers import run_all

RIG_TRUTH_NAME = "rig_truth.json"


def write_sample(
    folder: Path,
    scene: str = DEFAULT_SCENE,
    settings: SceneSettings | None = None,
    progress: Callable[[int, int], None] | None = None,
    *,
    with_truth: bool = True,
    rig: RoughRigSettings | None = None,
) -> Scene:
    """Render every view of a scene into an array folder, with its exact disparity as PFM.

    Args:
        folder: made where it is missing, else written into.
        scene: a name of `capture.scene.SCENES`.
        settings: grid, frames, size and seed; the scene's own where None.
        progress: called with (frame sets written, frame sets in all).
        with_truth: the disparity too, which takes more room than the pictures.
        rig: seen by such cameras instead of ideal ones; `rig_truth.json` says exactly which.

    Returns:
        The scene.

    Raises:
        SettingError: no such scene, or settings that it can't take.
        OutputError: the system refuses.
    """
    made = make_sample(scene, settings, rig)
    facts = ArrayFacts.of(made.array, licence=made.licence)
    with ArrayFolderWriter(folder, facts) as writer:
        for frame in range(made.frame_count):
            views = run_all(partial(_rendered, made, frame=frame), made.array.positions)
            pictures: dict[Position, Picture] = {view: picture for view, picture, _ in views}
            truth: dict[Position, FloatMap] = {
                view: disparity for view, _, disparity in views if with_truth and disparity is not None
            }
            writer.push(pictures, truth)
            if progress is not None:
                progress(frame + 1, made.frame_count)
        if isinstance(made, RoughScene):
            write_bytes(folder / RIG_TRUTH_NAME, (json.dumps(made.truth(), indent=2) + "\n").encode())
    return made


def make_sample(
    scene: str = DEFAULT_SCENE, settings: SceneSettings | None = None, rig: RoughRigSettings | None = None
) -> Scene:
    """A scene by name, seen by ideal cameras or by those of a rough rig.

    Raises:
        SettingError: no such scene, or settings that it can't take.
    """
    if rig is None:
        return make_scene(scene, settings)
    if scene != DEFAULT_SCENE:
        raise SettingError("rig", f"with the scene {scene}", f"the scene {DEFAULT_SCENE}")
    return RoughScene.of(settings or SceneSettings(), rig)


def _rendered(scene: Scene, view: Position, frame: int) -> tuple[Position, Picture, FloatMap | None]:
    picture, disparity = scene.render(Viewpoint(*view), frame)
    return view, picture, disparity
