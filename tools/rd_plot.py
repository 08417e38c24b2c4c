"""One rate-distortion figure from one or more reports of `mvcodec evaluate`.

    python tools/rd_plot.py REPORT/report.json [MORE.json ...] -o rd.svg [--metric psnr_y|ssim]
                            [--anchors NAME,..]

Reports of the same pictures share their panels: anchors once where they have the same points, and what
differs by the names of the reports' folders. The suffix of -o says what is written: .svg, .png or .pdf.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mvcodec.errors import InputError, MissingExtra, MvCodecError, OutputError, SettingError

SUFFIXES = (".svg", ".png", ".pdf")


def main(words: Sequence[str] | None = None) -> int:
    """Parse (the command line's words by default), read, draw."""
    parser = argparse.ArgumentParser(description="A rate-distortion figure of mvcodec's reports.")
    parser.add_argument("reports", type=Path, nargs="+", metavar="REPORT.json")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE")
    parser.add_argument("--metric", choices=("psnr_y", "ssim"), default="psnr_y")
    parser.add_argument(
        "--anchors",
        type=lambda text: text.split(","),
        default=(),
        metavar="NAME,..",
        help="the anchors to draw, as the reports name them (default: all)",
    )
    arguments = parser.parse_args(words)
    try:
        draw(arguments.reports, arguments.output, arguments.metric, arguments.anchors)
    except MvCodecError as error:
        print(f"rd_plot: {error}", file=sys.stderr)
        return 2 if isinstance(error, SettingError) else 1
    return 0


def draw(reports: Sequence[Path], output: Path, metric: str, anchors: Sequence[str] = ()) -> None:
    """Write the figure."""
    if output.suffix.lower() not in SUFFIXES:
        raise SettingError("--output", output, f"a name that ends in {', '.join(SUFFIXES)}")
    documents = [read(path) for path in reports]
    try:
        from mvcodec.evaluation.figures import saved
        from mvcodec.evaluation.rate_figure import rd_figure
    except ModuleNotFoundError as error:
        raise MissingExtra(error.name or "matplotlib", "evaluate") from None
    known = {curve["name"] for document in documents for curve in document["curves"]}
    if unknown := [name for name in anchors if name not in known]:
        raise SettingError("--anchors", ",".join(unknown), f"some of {', '.join(sorted(known))}")
    figure = rd_figure(documents, metric, names_of(reports), anchors)
    try:
        output.write_bytes(saved(figure, output.suffix.lower().removeprefix(".")))
    except OSError as error:
        raise OutputError(output, error.strerror or error) from None


def names_of(reports: Sequence[Path]) -> list[str]:
    """The folder's name of a report.json, else the file's; whole paths where these are alike."""
    names = [path.resolve().parent.name if path.name == "report.json" else path.stem for path in reports]
    return [str(path) if names.count(name) > 1 else name for path, name in zip(reports, names, strict=True)]


def read(path: Path) -> dict[str, Any]:
    """A report.json."""
    try:
        document = json.loads(path.read_bytes())
    except OSError as error:
        raise InputError(path, error.strerror, "a report.json") from None
    except ValueError as error:
        raise InputError(path, f"no JSON ({error})", "a report.json") from None
    if not isinstance(document, dict) or not {"input", "grid", "frames", "curves"} <= document.keys():
        raise InputError(path, "JSON of another kind", "a report.json of mvcodec evaluate")
    return document


if __name__ == "__main__":
    sys.exit(main())
