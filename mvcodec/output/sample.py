"""Writes a sample scene as an array folder."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from mvcodec.array import Position, Viewpoint
from mvcodec.frames import FloatMap, Picture
from mvcodec.output.array_folder import ArrayFacts, ArrayFolderWriter
from mvcodec.scenes.scene import DEFAULT_SCENE, Scene, SceneSettings, make_scene
from mvcodec.workers import run_all


def write_sample(
    folder: Path,
    scene: str = DEFAULT_SCENE,
    settings: SceneSettings | None = None,
    progress: Callable[[int, int], None] | None = None,
    *,
    with_truth: bool = True,
) -> Scene:
    """Render every view of a scene into an array folder, with its exact disparity as PFM.

    Args:
        folder: made where it is missing, else written into.
        scene: a name of `capture.scene.SCENES`.
        settings: grid, frames, size and seed; the scene's own where None.
        progress: called with (frame sets written, frame sets in all).
        with_truth: the disparity too, which takes more room than the pictures.

    Returns:
        The scene.

    Raises:
        SettingError: no such scene, or settings that it can't take.
        OutputError: the system refuses.
    """
    made = make_scene(scene, settings)
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
    return made


def _rendered(scene: Scene, view: Position, frame: int) -> tuple[Position, Picture, FloatMap | None]:
    picture, disparity = scene.render(Viewpoint(*view), frame)
    return view, picture, disparity
