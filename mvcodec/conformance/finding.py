"""What is wrong with a file, one thing at a time."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Severity(StrEnum):
    """How bad it is."""

    ERROR = "error"
    WARNING = "warning"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is not as FORMAT.md has it.

    Attributes:
        severity: an error costs pictures or breaks other tools; a warning breaks a rule only.
        code: short name of the rule.
        message: one line.
        topic: where, or None for the file as a whole.
        time_ns: when, or None.
    """

    severity: Severity
    code: str
    message: str
    topic: str | None = None
    time_ns: int | None = None


def error(code: str, message: str, topic: str | None = None, time_ns: int | None = None) -> Finding:
    """An error."""
    return Finding(Severity.ERROR, code, message, topic, time_ns)


def warning(code: str, message: str, topic: str | None = None, time_ns: int | None = None) -> Finding:
    """A warning."""
    return Finding(Severity.WARNING, code, message, topic, time_ns)
