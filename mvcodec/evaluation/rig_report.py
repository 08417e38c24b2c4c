"""The report of `mvcodec rectify`: one HTML page with pictures, which needs nothing from elsewhere."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from mvcodec.array import Position
from mvcodec.evaluation.page import STYLE
from mvcodec.frames import Picture
from mvcodec.rigs.calibration import Calibrated
from mvcodec.rigs.features import Tracks
from mvcodec.rigs.remap import Rectifier
from mvcodec.rigs.residuals import Residuals, rectified_tracks

_LINES = 9
_WIDTH = 1200
_GOOD_PX = 0.5
_CENTRES_APART = 0.01
"""In widths of the picture: by how much the principal points of two cameras of one kind may differ."""
_COLOURS = ((213, 94, 0), (0, 114, 178), (0, 158, 115), (204, 121, 167), (230, 159, 0))


def rig_report(found: Calibrated, name: str) -> str:
    """The whole page.

    Args:
        found: a calibrated rig, and what it was found from.
        name: of the input.
    """
    title = f"Rig: {name}"
    parts = [
        "<!doctype html>",
        f'<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<style>{STYLE}</style></head><body>",
        f"<h1>{escape(title)}</h1>",
        f'<p class="soft">{escape(found.summary())}</p>',
        "<h2>How well rows and columns agree</h2>",
        _residuals(found.before, found.after),
        "<h2>What could not be explained, and what to do</h2>",
        _list(advice(found)),
        *_pictures(found),
        "<h2>The cameras</h2>",
        _cameras(found),
        "<h2>Matches between neighbours</h2>",
        _pairs(found),
        "</body></html>",
    ]
    return "\n".join(parts) + "\n"


def advice(found: Calibrated) -> list[str]:
    """What the figures say that people should know or do, one sentence each."""
    figures = found.rig.figures
    said = []
    total = figures["observations"] + figures["observations_left_out"]
    share = figures["observations_left_out"] / max(total, 1)
    said.append(
        f"{figures['observations_left_out']} of {total} observations ({share:.0%}) were left out: wrong"
        " matches, or things that move while a camera is late."
    )
    if share > 0.25:
        said.append(
            "That is many. Rectify from a scene that stands still, or check that all cameras run in step."
        )
    left = figures["left_by_places_px"]
    if left > _GOOD_PX:
        said.append(
            f"Cameras stand beside their places on the grid: up to {left:.1f} px remain at the nearest and"
            " farthest things. Only moving the cameras mends that."
        )
    for word, spread in (("rows", found.after.rows), ("columns", found.after.columns)):
        if spread.median is not None and spread.median > _GOOD_PX:
            said.append(
                f"{word.capitalize()} still are {spread.text()} apart. Try more frames, a scene with more"
                " texture near and far, or a board."
            )
    if found.rig.found_by == "scene":
        view = found.rig.rectified
        shift_px = _CENTRES_APART * found.rig.source_size[0]
        share = shift_px / max(view.typical_w * view.focal_px, 1e-6)
        said.append(
            "Found from the scene alone: how large things are is not known, and baselines are not metric. Nor"
            f" are distances, though views are right: lenses that sit aside by {_CENTRES_APART:.0%} of the"
            " picture's width look like turned cameras, and shift all disparities by"
            f" {shift_px:.0f} px, {share:.0%} of what is usual here. A board or calibration files tell."
        )
    return said


def _list(items: Iterable[str]) -> str:
    return "<ul>" + "".join(f"<li>{escape(item)}</li>" for item in items) + "</ul>"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    cells = "".join(f"<th>{escape(name)}</th>" for name in head)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<div class="scroll"><table><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table></div>'


def _residuals(before: Residuals, after: Residuals) -> str:
    rows = [
        ("rows of cameras in a row", before.rows.text(), after.rows.text()),
        ("columns of cameras in a column", before.columns.text(), after.columns.text()),
        ("all, against one disparity a point", before.model.text(), after.model.text()),
    ]
    return _table(["apart: median (95 %)", "before", "after"], rows)


def _cameras(found: Calibrated) -> str:
    rows = []
    view = found.rig.rectified
    for at, camera in found.rig.cameras.items():
        x, y, z = Rotation.from_matrix(camera.turn).as_rotvec(degrees=True)
        beside = (camera.place - (at[1], at[0] * view.rho, 0.0)) * 100
        lens = camera.lens
        rows.append(
            (
                f"{at[0]},{at[1]}",
                f"{x:+.2f} {y:+.2f} {z:+.2f}",
                f"{lens.focal_px[0]:.1f}",
                f"{lens.centre_px[0]:.1f} {lens.centre_px[1]:.1f}",
                " ".join(f"{value:+.4f}" for value in lens.coefficients),
                " ".join(f"{value:+.2f}" for value in beside),
                " ".join(f"{value:.3f}" for value in camera.gain),
            )
        )
    head = [
        "camera",
        "turned by, degrees (pitch, yaw, roll)",
        "focal length, px",
        "centre, px",
        "distortion",
        "beside its place, % of a step (x, y, z)",
        "gain (R, G, B)",
    ]
    return _table(head, rows)


def _pairs(found: Calibrated) -> str:
    rows = [
        (
            f"{pair.one[0]},{pair.one[1]} - {pair.other[0]},{pair.other[1]}",
            str(pair.matched),
            f"{pair.agreed} ({pair.agreed / max(pair.matched, 1):.0%})",
        )
        for pair in found.pairs
    ]
    return _table(["cameras", "matches", "of these, on one epipolar geometry"], rows)


def _pictures(found: Calibrated) -> list[str]:
    """Pairs of neighbours before and after, with lines through what should be in one row or column."""
    first = found.frame_sets[0].pictures
    rectifier = Rectifier(found.rig)
    straight = {at: rectifier.picture(at, first[at]) for at in found.rig.cameras}
    origin = min(found.rig.cameras)
    after = rectified_tracks(found.rig, found.tracks)
    parts = []
    for other, word in (((origin[0], origin[1] + 1), "row"), ((origin[0] + 1, origin[1]), "column")):
        if other in found.rig.cameras:
            parts.append(f"<h2>One {word} through two cameras</h2>")
            for pictures, tracks, when in ((first, found.tracks, "before"), (straight, after, "after")):
                drawn = _lines(
                    pictures[origin], pictures[other], tracks, (origin, other), upright=word == "column"
                )
                text = (
                    f"{when}: lines lead from where one camera shows points; circles are where the other does"
                )
                parts.append(_figure(drawn, text))
    view = found.rig.rectified
    disparity = view.typical_w * view.focal_px
    met = [
        _moved(picture, disparity * at[1], disparity * view.rho * at[0]) for at, picture in straight.items()
    ]
    mean = np.mean([picture.astype(np.float32) for picture in met], axis=0)
    parts.append("<h2>All rectified pictures over each other</h2>")
    parts.append(_figure(np.rint(mean).astype(np.uint8), "what is at the typical distance is sharp"))
    return parts


def _moved(picture: Picture, right_px: float, down_px: float) -> Picture:
    move = np.array([[1, 0, right_px], [0, 1, down_px]])
    size = picture.shape[1], picture.shape[0]
    return np.asarray(cv2.warpAffine(picture, move, size, borderMode=cv2.BORDER_REPLICATE), np.uint8)


def _lines(
    one: Picture, other: Picture, tracks: Tracks, pair: tuple[Position, Position], *, upright: bool
) -> Picture:
    """Two pictures beside (`upright`: above) each other, with lines along rows (columns)."""
    height, width = one.shape[:2]
    both = np.concatenate([one, other], axis=0 if upright else 1).copy()
    numbers = [tracks.cameras.index(at) for at in pair]
    seen = tracks.seen[:, numbers].all(axis=1) & (tracks.frame == 0)
    points = tracks.xy_px[seen][:, numbers]
    axis = 0 if upright else 1
    order = np.argsort(points[:, 0, axis])
    for number, index in enumerate(
        order[np.linspace(0, len(order) - 1, min(len(order), _LINES)).astype(int)]
    ):
        colour = _COLOURS[number % len(_COLOURS)]
        start, there = points[index, 0], points[index, 1] + ((0, height) if upright else (width, 0))
        end = (start[0], there[1]) if upright else (there[0], start[1])
        a, b, c = (tuple(round(float(v)) for v in place) for place in (start, end, there))
        cv2.line(both, a, b, colour, 1, cv2.LINE_AA)
        cv2.circle(both, c, 5, colour, 2, cv2.LINE_AA)
    return both


def _figure(picture: Picture, text: str) -> str:
    width = min(_WIDTH, picture.shape[1])
    size = width, max(1, round(picture.shape[0] * width / picture.shape[1]))
    small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", cv2.cvtColor(small, cv2.COLOR_RGB2BGR), (cv2.IMWRITE_JPEG_QUALITY, 88))
    source = "data:image/jpeg;base64," + base64.b64encode(data.tobytes()).decode()
    return (
        f'<figure><img src="{source}" alt="{escape(text)}"><figcaption>{escape(text)}</figcaption></figure>'
    )
