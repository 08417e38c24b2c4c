"""Offsets of the topics of a recording against the first one, by what moves in their pictures."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import islice

from mvcodec.capture.recording import Recording
from mvcodec.capture.recording_settings import RecordingSettings
from mvcodec.capture.sync import MAX_PICTURES, Motion, motion_of
from mvcodec.capture.sync_views import offsets_by_motion
from mvcodec.errors import MvCodecWarning


def with_offsets(
    settings: RecordingSettings, opened: Callable[[RecordingSettings], Recording]
) -> RecordingSettings:
    """Settings with the offsets that the pictures tell; those that the user gave stay.

    Args:
        opened: opens the recording from its beginning, as it is asked to.

    Raises:
        InputError: nothing tells how far a camera's clock is apart.
    """
    topics = list(settings.read_topics())
    signals: dict[str, Motion] = {}
    steps: dict[str, Sequence[int]] = {}
    for topic in topics:
        alone = replace(
            settings, topics=((topic,),), real="corners", depth_topics=None, offsets_ms={}, split=(1, 1)
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MvCodecWarning)  # told when all are read
            frames = list(islice(opened(alone).frame_sets(), MAX_PICTURES))
        steps[topic] = [frame.time_ns for frame in frames]
        pictures = (picture for frame in frames for picture in frame.pictures.values())
        signals[topic] = motion_of(pictures, steps[topic])
    found = offsets_by_motion(signals, steps, {topic: topic for topic in topics})
    return replace(settings, offsets_ms={t: ns / 1e6 for t, ns in found.items()} | dict(settings.offsets_ms))
