"""``mvcodec validate``: a file against the rules of the format."""

from __future__ import annotations

import argparse
import json
from typing import Any

from mvcodec.cli.info import count
from mvcodec.cli.paths import local_path
from mvcodec.cli.safety import add_limits
from mvcodec.conformance.finding import Finding, Severity
from mvcodec.conformance.validation import FileKind, examine
from mvcodec.container.limits import Limits
from mvcodec.errors import MvCodecError
from mvcodec.stream import HEADER_TRACK

_KINDS: dict[FileKind | None, str] = {
    FileKind.VIEWS: f" (video topics without {HEADER_TRACK.topic}: checked as such)",
    FileKind.POINTS: " (point clouds: checked as such)",
}
"""What is said of a file that is not one of FORMAT.md's."""


class NotClean(MvCodecError):
    """Something was found."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``validate``."""
    parser.add_argument("input", type=local_path, metavar="FILE.mcap", help="the file to check")
    parser.add_argument("--json", action="store_true", help="print the findings as JSON")
    add_limits(parser)


def run(arguments: argparse.Namespace) -> None:
    """Print what is wrong; the exit code is 0 only where nothing is."""
    found = examine(arguments.input, Limits(**dict(arguments.limit)))
    findings, said = found.findings, _KINDS.get(found.kind, "")
    if arguments.json:
        document = {
            "file": str(arguments.input),
            "kind": found.kind,
            "clean": not findings,
            "findings": [_document(finding) for finding in findings],
        }
        print(json.dumps(document))
    else:
        print("\n".join(_line(finding) for finding in findings) or f"{arguments.input}: clean{said}")
    if findings:
        errors = sum(finding.severity is Severity.ERROR for finding in findings)
        counts = f"{count(errors, 'error')}, {count(len(findings) - errors, 'warning')}"
        raise NotClean(f"{arguments.input}: {counts}{said}")


def _document(finding: Finding) -> dict[str, Any]:
    return {
        "severity": finding.severity.value,
        "code": finding.code,
        "topic": finding.topic,
        "time_s": None if finding.time_ns is None else finding.time_ns / 1e9,
        "message": finding.message,
    }


def _line(finding: Finding) -> str:
    time = "" if finding.time_ns is None else f" at {finding.time_ns / 1e9:.3f} s"
    return f"{finding.severity}: {finding.topic or 'file'}{time}: {finding.message} [{finding.code}]"
