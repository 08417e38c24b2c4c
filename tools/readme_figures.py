"""Write a document's tables of figures from measurements: between its two marks, nothing by hand.

python tools/benchmark.py --data ../shared/data --what quality --json > quality.json
mvcodec evaluate ../shared/data/SET --output REPORT ...
python tools/readme_figures.py docs/quality.md --quality quality.json --reports REPORT/report.json ...
python benchmarks/speed.py --json > speed.json
python tools/readme_figures.py docs/speed.md --speed speed.json
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

MARKS = "<!-- figures -->", "<!-- end of figures -->"


def main() -> int:
    """Parse, read, write."""
    parser = argparse.ArgumentParser(description="A document's tables of figures, from measurements.")
    parser.add_argument("document", type=Path, metavar="DOCUMENT")
    parser.add_argument("--quality", type=Path, metavar="FILE.json", help="of tools/benchmark.py")
    parser.add_argument("--speed", type=Path, metavar="FILE.json", help="of benchmarks/speed.py")
    parser.add_argument(
        "--reports", type=Path, nargs="*", default=[], metavar="REPORT.json", help="of evaluate"
    )
    arguments = parser.parse_args()
    try:
        text = arguments.document.read_text(encoding="utf-8")
        tables = [
            table(_read(path))
            for table, path in ((quality_table, arguments.quality), (speed_table, arguments.speed))
            if path is not None
        ]
        tables.append(rate_table([_read(path) for path in arguments.reports]))
        write_bytes(arguments.document, replaced(text, tables, arguments.document).encode())
    except (MvCodecError, OSError) as error:
        print(f"readme_figures: {error}", file=sys.stderr)
        return 1
    return 0


def replaced(text: str, tables: Sequence[str], source: Path, marks: tuple[str, str] = MARKS) -> str:
    """The text with the tables between the marks.

    Raises:
        InputError: the marks are not there, once each and in order.
    """
    before, begin, rest = text.partition(marks[0])
    _, end, after = rest.partition(marks[1])
    if not begin or not end:
        raise InputError(source, "no place for the figures", f"a line {marks[0]} and a line {marks[1]}")
    body = "\n\n".join(table for table in tables if table)
    return f"{before}{begin}\n\n{body}\n\n{end}{after}"


def quality_table(benchmark: Mapping[str, Any]) -> str:
    """Synthesis alone: the corner cameras uncoded, by set."""
    lines = ["| set | Y-PSNR, dB | worst view, dB | SSIM |", "|---|---|---|---|"]
    for name, row in sorted(benchmark["sets"].items()):
        lines.append(f"| {name} | {row['psnr_y']:.2f} | {row['worst_psnr_y']:.2f} | {row['ssim']:.4f} |")
    return "\n".join(lines)


def speed_table(benchmark: Mapping[str, Any]) -> str:
    """Our times beside those of stock code on the same pictures, one line a work."""
    lines = ["| work | ours, ms | stock, ms | ratio | goal |", "|---|---|---|---|---|"]
    for row in benchmark["rows"]:
        kind = "cpu_" if row["by_cpu"] else ""
        ours, theirs = row[f"ours_{kind}ms"], row[f"theirs_{kind}ms"]
        rate = f", {row['note'].split(';')[0]}" if row["note"] else ""
        goal = "" if row["must"] is None else f"{row['must']:g}"
        lines.append(f"| {row['work']}{rate} | {ours:.1f} | {theirs:.1f} | {row['ratio']:.2f} | {goal} |")
    return "\n".join(lines)


def rate_table(reports: Sequence[Mapping[str, Any]]) -> str:
    """BD-rate against each anchor, with the dB that it holds for, one line an input; who overtakes first."""
    if not reports:
        return ""
    anchors = list(dict.fromkeys(anchor for report in reports for anchor in report["bd_rate"]))
    lines = [
        f"| input | codec | {' | '.join(anchors)} | first overtaken |",
        "|---" * (len(anchors) + 3) + "|",
    ]
    for report in reports:
        deltas, codec = report["bd_rate"], report["curves"][0]["codec"]
        cells = [_percent(deltas[anchor]) if anchor in deltas else "" for anchor in anchors]
        lines.append(f"| {' | '.join([Path(report['input']).name, codec, *cells, _overtaken(deltas)])} |")
    return "\n".join(lines)


def _percent(delta: Mapping[str, Any]) -> str:
    if delta["all"] is None:
        return "no common quality"
    low, high = delta["overlap_db"]
    return f"{delta['all']:+.1f} % ({low:.1f} - {high:.1f})"


def _overtaken(deltas: Mapping[str, Mapping[str, Any]]) -> str:
    """The anchor that stays ahead from the lowest rate on, and who is ahead before it is passed."""
    parts = []
    places = {anchor: delta["overtaken"] for anchor, delta in deltas.items() if delta["overtaken"]}
    if places:
        anchor = min(places, key=lambda name: places[name]["kbps"])
        where = places[anchor]
        sign = "everywhere, <= " if where["at_most"] else ""
        parts.append(f"{anchor}: {sign}{where['kbps'] / 1000:.2f} Mbit/s, {where['psnr_y']:.1f} dB")
    for anchor, delta in deltas.items():
        # Reports that are older than this entry tell of the last range alone.
        ranges = delta.get("anchor_ahead_kbps", [])
        for low, high in ranges[:-1] if anchor in places else ranges:
            parts.append(f"{anchor}: {low / 1000:.2f} - {high / 1000:.2f} Mbit/s")
    return "; ".join(parts)


def _read(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(path, f"no JSON ({error})", "a file that benchmark or evaluate wrote") from None


if __name__ == "__main__":
    sys.exit(main())
