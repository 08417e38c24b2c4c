"""Room 1: pictures in. Array folders, video files and the sample scenes."""

from mvcodec.capture.opening import open_input
from mvcodec.capture.source import ArraySource, resolve_frames

__all__ = ["ArraySource", "open_input", "resolve_frames"]
