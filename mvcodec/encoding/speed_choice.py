"""One word for how much time coding may take: it sets the matcher and the effort of the video encoder."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Speed:
    """What a speed stands for.

    Attributes:
        matcher: a name of `mvcodec.stereo.matchers.MATCHERS`.
        preset: of the video encoder.
    """

    matcher: str
    preset: str


SPEEDS = {
    "realtime": Speed("realtime", "veryfast"),
    "balanced": Speed("balanced", "medium"),
    "best": Speed("joint", "slow"),
}

FOR_FILES, FOR_LIVE = "best", "realtime"
