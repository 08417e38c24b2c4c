"""`report.html`: one page that needs nothing from elsewhere."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from mvcodec.evaluation.document import every_warning

STYLE = """
:root { --ink: #1a1a1a; --soft: #5c5c5c; --line: #dcdcdc; --ours: #D55E00; }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: #fff; max-width: 110rem;
  margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.5rem; margin: 0 0 .2rem; } h2 { font-size: 1.1rem; margin: 2.2rem 0 .4rem; }
p, ul { max-width: 64rem; } p { margin: .4rem 0; } .soft { color: var(--soft); }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .85rem; }
th, td { padding: .22rem .38rem; text-align: right; border-bottom: 1px solid var(--line);
  white-space: nowrap; }
th { font-weight: 600; vertical-align: bottom; white-space: normal; }
th:first-child, td:first-child { text-align: left; padding-left: 0; white-space: normal; }
td:first-child { min-width: 9rem; }
tr.ours td { font-weight: 600; } tr.ours td:first-child { color: var(--ours); }
tr.first td { border-top: 2px solid var(--line); }
figure { margin: .6rem 0; } figure img { max-width: min(100%, 64rem); height: auto; }
figcaption { color: var(--soft); font-size: .9rem; max-width: 48rem; }
ul { padding-left: 1.2rem; margin: .4rem 0; }
.warning { border-left: 4px solid #E69F00; padding: .3rem .9rem; }
code { font-size: .85rem; overflow-wrap: anywhere; } details { margin: .5rem 0; } summary { cursor: pointer; }
"""


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """A figure of the page: an SVG document or a PNG picture, with a caption."""

    title: str
    image: bytes
    text: str


def make_page(document: Mapping[str, Any], shown: Sequence[Shown]) -> str:
    """The whole page."""
    title = f"Rate and distortion: {document['input']}"
    parts = [
        "<!doctype html>",
        f'<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<style>{STYLE}</style></head><body>",
        f"<h1>{escape(title)}</h1>",
        f'<p class="soft">{escape(_summary(document))}</p>',
        _heading("mvcodec against the anchors"),
        _deltas(document),
        _warnings(document),
        *[_figure(figure) for figure in shown],
        _heading("Every point"),
        _points(document),
        _heading("How it was measured"),
        _method(document),
        "</body></html>",
    ]
    return "\n".join(parts) + "\n"


def _summary(document: Mapping[str, Any]) -> str:
    (rows, cols), (width, height) = document["grid"], document["size"]
    first, count = document["first_frame"], document["frames"]
    frames = f"frames {first} to {first + count - 1}" if count > 1 else f"frame {first}"
    return (
        f"{rows} x {cols} views of {width} x {height} px, {document['fps']:g} frames a second, {frames}; "
        f"{len(document['real'])} real cameras are coded by mvcodec, "
        f"{rows * cols - len(document['real'])} views are synthesised. "
        f"mvcodec {document['versions']['mvcodec']}."
    )


def _heading(text: str) -> str:
    return f"<h2>{escape(text)}</h2>"


def _table(head: Sequence[str], rows: Iterable[tuple[str, Sequence[str]]]) -> str:
    """Rows are (class of the row, cells)."""
    cells = "".join(f"<th>{name}</th>" for name in head)
    body = "".join(
        f'<tr class="{kind}">' + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>"
        for kind, row in rows
    )
    return f'<div class="scroll"><table><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table></div>'


def _deltas(document: Mapping[str, Any]) -> str:
    labels = {curve["name"]: curve["label"] for curve in document["curves"]}
    head = [
        "Anchor",
        "BD-rate<br>all views",
        "BD-rate<br>virtual views",
        "BD-PSNR<br>all views",
        "quality in common<br>all views",
        "overtakes mvcodec at",
    ]
    rows = []
    for name, delta in document["bd_rate"].items():
        overlap = delta["overlap_db"]
        cells = [
            labels[name],
            _number(delta["all"], "+.1f", " %"),
            _number(delta["virtual"], "+.1f", " %"),
            _number(delta["bd_psnr_db"]["all"], "+.2f", " dB"),
            "none" if overlap is None else f"{overlap[0]:.2f} to {overlap[1]:.2f} dB",
            _overtaken(delta),
        ]
        rows.append(("", cells))
    text = (
        "BD-rate: the bits that mvcodec needs, compared with the anchor's, for equal quality (negative:"
        " fewer); BD-PSNR: its gain in luma PSNR at equal rate. Piecewise cubics (PCHIP) over the"
        " logarithm of the rate, over the range that both curves reach. From the stated rate on the"
        " anchor is better, up to its highest; above its own highest rate a curve counts as flat."
    )
    return f'<p class="soft">{escape(text)}</p>' + _table(head, rows)


def _overtaken(delta: Mapping[str, Any]) -> str:
    found, ranges = delta["overtaken"], delta["anchor_ahead_kbps"]
    earlier = [f"{low:.0f} to {high:.0f}" for low, high in (ranges if found is None else ranges[:-1])]
    if found is None:
        return f"not at the end; ahead at {', '.join(earlier)} kbit/s" if earlier else "not in this range"
    place = f"{found['kbps']:.0f} kbit/s, {found['psnr_y']:.2f} dB"
    if found["at_most"]:
        return f"ahead everywhere, from {place} or below"
    return place + (f"; ahead at {', '.join(earlier)} kbit/s, too" if earlier else "")


def _warnings(document: Mapping[str, Any]) -> str:
    warnings = every_warning(document)
    if not warnings:
        return ""
    items = "".join(f"<li>{escape(text)}</li>" for text in warnings)
    count = f"{len(warnings)} thing{'s' * (len(warnings) != 1)} to know about these figures"
    return f'<details class="warning"><summary>{count}</summary><ul>{items}</ul></details>'


def _figure(shown: Shown) -> str:
    kind = "png" if shown.image.startswith(b"\x89PNG") else "svg+xml"
    data = base64.b64encode(shown.image).decode()
    caption = f"<figcaption>{escape(shown.text)}</figcaption>" if shown.text else ""
    image = f'<img alt="{escape(shown.title)}" src="data:image/{kind};base64,{data}">'
    return f"{_heading(shown.title)}<figure>{image}{caption}</figure>"


def _points(document: Mapping[str, Any]) -> str:
    head = ["Curve", "QP", "kbit/s", "kbit a<br>frame set", "maps", "map<br>QP"]
    head += [f"Y&#8209;PSNR<br>dB, {kind}" for kind in ("all", "real", "virtual", "worst")]
    head += ["YUV&#8209;PSNR<br>dB, all", *(f"SSIM<br>{kind}" for kind in ("all", "virtual"))]
    head += ["encode<br>s", "of it<br>matching", "decode<br>s"]
    rows = []
    for curve in document["curves"]:
        for number, point in enumerate(curve["points"]):
            own = "ours" if curve["anchor"] is None else ""
            maps = point["bits_split"]["disparity"] / point["bits"]
            cells = [curve["label"] if number == 0 else "", str(point["qp"]), f"{point['kbps']:.1f}"]
            cells += [f"{point['bits'] / document['frames'] / 1000:.1f}", f"{maps:.0%}" if own else ""]
            cells += [str(point.get("settings", {}).get("disparity_qp", ""))]
            cells += [_number(point["psnr_y"][kind], ".2f") for kind in ("all", "real", "virtual", "worst")]
            cells += [_number(point["psnr_yuv"]["all"], ".2f")]
            cells += [_number(point["ssim"][kind], ".4f") for kind in ("all", "virtual")]
            cells += [
                f"{point['encode_seconds']:.1f}",
                f"{point['match_seconds']:.1f}" if own else "",
                f"{point['decode_seconds']:.1f}",
            ]
            rows.append((f"{own} {'first' if number == 0 else ''}".strip(), cells))
    return _table(head, rows)


METHOD = (
    "The same frames, preset and keyframe times for all curves; colour is converted exactly, and luma"
    " PSNR and SSIM are taken of the decoded pictures in RGB. YUV-PSNR is (6 Y + Cb + Cr) / 8."
    " Each codec's QP is on its own scale;"
    " AV1's are chosen to give about the PSNR of the others.",
    "Anchors: every view of the array, by a stock encoder with constant QP and without a zero-latency"
    " tune. Psycho-visual decisions are off in them as they are in mvcodec's streams, because that"
    " raises their PSNR for the bits. Simulcast codes each view by itself, without B-frames as mvcodec"
    " does, and with the preset's own. PVS codes the views as one pseudo-video sequence: the whole"
    " matrix in serpentine order, time after time, forwards and backwards by turns; or each row. It"
    " has the preset's B-frames and one keyframe at each keyframe time.",
    "Bits: mvcodec's whole file with its container; of the anchors the elementary streams alone.",
    "Seconds are wall-clock time of the coding alone: mvcodec's encoding includes matching, which is"
    " done once for all QPs and counted in each, its decoding the synthesis of every view, on all"
    " cores; an anchor's are those of one thread for each sequence, summed, while others may run"
    " beside it.",
)


def _method(document: Mapping[str, Any]) -> str:
    text = "".join(f"<p>{escape(paragraph)}</p>" for paragraph in METHOD)
    settings = "".join(
        f"<li>{escape(curve['label'])}: <code>"
        + escape(
            ", ".join(f"{name}={value}" for name, value in curve["options"].items() if value is not None)
        )
        + "</code></li>"
        for curve in document["curves"]
    )
    return (
        f"{text}<details><summary>Settings (at the first QP)</summary><ul>{settings}</ul></details>"
        + _versions(document)
    )


def _versions(document: Mapping[str, Any]) -> str:
    """Of the report and of its points, which may have been measured by earlier runs."""
    made_with = [(_listed(document["versions"]), "this report")]
    made_with += [
        (_listed(found), curve["label"]) for curve in document["curves"] for found in curve["versions"]
    ]
    users: dict[str, list[str]] = {}
    for versions, user in made_with:
        users.setdefault(versions, []).append(user)
    items = "".join(f"<li>{escape('; '.join(who))}: {escape(what)}</li>" for what, who in users.items())
    summary = "Versions that the report and its points were made with, as far as they are known"
    return f"<details><summary>{summary}</summary><ul>{items}</ul></details>"


def _listed(versions: Mapping[str, str]) -> str:
    return ", ".join(f"{name} {version}" for name, version in versions.items())


def _number(value: float | None, form: str, unit: str = "") -> str:
    return "-" if value is None else f"{value:{form}}{unit}"
