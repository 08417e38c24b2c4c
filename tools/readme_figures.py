"""Write README's tables of figures from measurements: between its two marks, nothing by hand.

python tools/benchmark.py --data ../shared/data --what quality --json > quality.json
mvcodec evaluate ../shared/data/SET --output REPORT ...
python tools/readme_figures.py README.md --quality quality.json --reports REPORT/report.json ...
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mvcodec.errors import InputError, MvCodecError
from mvcodec.output.atomic import write_bytes

BEGIN, END = "<!-- figures -->", "<!-- end of figures -->"


def main() -> int:
    """Parse, read, write."""
    parser = argparse.ArgumentParser(description="README's tables of figures, from measurements.")
    parser.add_argument("readme", type=Path, metavar="README.md")
    parser.add_argument(
        "--quality", type=Path, required=True, metavar="FILE.json", help="of tools/benchmark.py"
    )
    parser.add_argument(
        "--reports", type=Path, nargs="*", default=[], metavar="REPORT.json", help="of evaluate"
    )
    arguments = parser.parse_args()
    try:
        text = arguments.readme.read_text(encoding="utf-8")
        tables = [
            quality_table(_read(arguments.quality)),
            rate_table([_read(path) for path in arguments.reports]),
        ]
        write_bytes(arguments.readme, replaced(text, tables, arguments.readme).encode())
    except (MvCodecError, OSError) as error:
        print(f"readme_figures: {error}", file=sys.stderr)
        return 1
    return 0


def replaced(text: str, tables: Sequence[str], source: Path) -> str:
    """The text with the tables between the marks.

    Raises:
        InputError: the marks are not there, once each and in order.
    """
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise InputError(source, "no place for the figures", f"a line {BEGIN} and a line {END}")
    body = "\n\n".join(table for table in tables if table)
    return f"{before}{BEGIN}\n\n{body}\n\n{END}{after}"


def quality_table(benchmark: Mapping[str, Any]) -> str:
    """Synthesis alone: the corner cameras uncoded, by set."""
    lines = ["| set | Y-PSNR, dB | worst view, dB | SSIM |", "|---|---|---|---|"]
    for name, row in sorted(benchmark["sets"].items()):
        lines.append(f"| {name} | {row['psnr_y']:.2f} | {row['worst_psnr_y']:.2f} | {row['ssim']:.4f} |")
    return "\n".join(lines)


def rate_table(reports: Sequence[Mapping[str, Any]]) -> str:
    """BD-rate against the anchors of the same codec, one line an input; who overtakes first."""
    if not reports:
        return ""
    anchors = list(dict.fromkeys(anchor for report in reports for anchor in report["bd_rate"]))
    lines = [
        f"| input | codec | {' | '.join(anchors)} | overlap, dB | first overtaken |",
        "|---" * (len(anchors) + 4) + "|",
    ]
    for report in reports:
        rates, codec = report["bd_rate"], report["curves"][0]["codec"]
        known = {anchor: rates[anchor] for anchor in anchors if rates.get(anchor, {}).get("all") is not None}
        cells = [f"{known[anchor]['all']:+.1f} %" if anchor in known else "" for anchor in anchors]
        low = min(figures["overlap_db"][0] for figures in known.values())
        high = max(figures["overlap_db"][1] for figures in known.values())
        line = [Path(report["input"]).name, codec, *cells, f"{low:.1f} - {high:.1f}", _overtaken(known)]
        lines.append(f"| {' | '.join(line)} |")
    return "\n".join(lines)


def _overtaken(known: Mapping[str, Mapping[str, Any]]) -> str:
    """The anchor that is ahead of mvcodec from the lowest bit rate on, and that rate."""
    places = {anchor: figures["overtaken"] for anchor, figures in known.items() if figures["overtaken"]}
    if not places:
        return ""
    anchor = min(places, key=lambda name: places[name]["kbps"])
    where = places[anchor]
    sign = "<= " if where["at_most"] else ""
    return f"{anchor}: {sign}{where['kbps'] / 1000:.2f} Mbit/s, {where['psnr_y']:.1f} dB"


def _read(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(path, f"no JSON ({error})", "a file that benchmark or evaluate wrote") from None


if __name__ == "__main__":
    sys.exit(main())
