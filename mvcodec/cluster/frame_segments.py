"""Which frames of a recording are coded as one segment."""

from __future__ import annotations


def cut(frames: range, gop: int, fps: float, seconds: float | None) -> list[range]:
    """Consecutive ranges of frames, each of which begins where a keyframe falls.

    Args:
        frames: those of the recording that are coded.
        gop: frame sets from keyframe to keyframe.
        seconds: the length that segments should have; they get the next number of whole GOPs.
            None: one segment.
    """
    if seconds is None:
        return [frames]
    length = max(round(seconds * fps / gop), 1) * gop
    return [frames[start : start + length] for start in range(0, len(frames), length)]
