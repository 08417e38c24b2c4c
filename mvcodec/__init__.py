"""mvcodec: a free-viewpoint video codec for sparse camera arrays.

What is listed in `mvcodec.__all__` is the public interface; it changes with a new version number and a line
in CHANGELOG.md only. Everything else, all modules inside of the package, is private and may change any time.
Names are loaded when they are first used, so that ``import mvcodec`` takes no time.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mvcodec.array import Calibration, CameraArray, Position, Viewpoint
    from mvcodec.capture.opening import open_input
    from mvcodec.capture.reading import Reading
    from mvcodec.capture.source import ArraySource
    from mvcodec.capture.timing import Timing
    from mvcodec.container.file_facts import StreamInfo, read_info
    from mvcodec.container.limits import Limits
    from mvcodec.container.reader import McapReader
    from mvcodec.container.writer import McapWriter
    from mvcodec.decoding.decoder import Decoder
    from mvcodec.decoding.video import Video, open
    from mvcodec.encoding.config import EncoderConfig
    from mvcodec.encoding.encoder import Encoder
    from mvcodec.encoding.pictures_to_file import encode
    from mvcodec.errors import (
        InputError,
        MissingExtra,
        MissingReference,
        MvCodecError,
        MvCodecWarning,
        NoSuchFrame,
        OutputError,
        SettingError,
        StreamClosed,
        StreamError,
    )
    from mvcodec.frames import DecodedSet, DisparityMap, FrameSet, Picture, RenderedView
    from mvcodec.layers.refinement import make_matcher
    from mvcodec.plugin_tables import Plugin
    from mvcodec.settings import setting
    from mvcodec.stereo.matcher import Matcher, PairMatcher
    from mvcodec.stream import Packet, StreamHeader
    from mvcodec.synthesis.synthesizer import Synthesizer
    from mvcodec.synthesis.synthesizers import make_synthesizer
    from mvcodec.video.codec import RateControl

__version__ = "0.2.0"

_MODULES = {
    "mvcodec.array": "Calibration CameraArray Position Viewpoint",
    "mvcodec.capture.opening": "open_input",
    "mvcodec.capture.reading": "Reading",
    "mvcodec.capture.source": "ArraySource",
    "mvcodec.capture.timing": "Timing",
    "mvcodec.container.file_facts": "StreamInfo read_info",
    "mvcodec.container.limits": "Limits",
    "mvcodec.container.reader": "McapReader",
    "mvcodec.container.writer": "McapWriter",
    "mvcodec.decoding.decoder": "Decoder",
    "mvcodec.decoding.video": "Video open",
    "mvcodec.encoding.config": "EncoderConfig",
    "mvcodec.encoding.encoder": "Encoder",
    "mvcodec.encoding.pictures_to_file": "encode",
    "mvcodec.errors": "InputError MissingExtra MissingReference MvCodecError MvCodecWarning NoSuchFrame"
    " OutputError SettingError StreamClosed StreamError",
    "mvcodec.frames": "DecodedSet DisparityMap FrameSet Picture RenderedView",
    "mvcodec.layers.refinement": "make_matcher",
    "mvcodec.plugin_tables": "Plugin",
    "mvcodec.settings": "setting",
    "mvcodec.stereo.matcher": "Matcher PairMatcher",
    "mvcodec.stream": "Packet StreamHeader",
    "mvcodec.synthesis.synthesizer": "Synthesizer",
    "mvcodec.synthesis.synthesizers": "make_synthesizer",
    "mvcodec.video.codec": "RateControl",
}
_HOMES = {name: module for module, names in _MODULES.items() for name in names.split()}

__all__ = [
    "ArraySource",
    "Calibration",
    "CameraArray",
    "DecodedSet",
    "Decoder",
    "DisparityMap",
    "Encoder",
    "EncoderConfig",
    "FrameSet",
    "InputError",
    "Limits",
    "Matcher",
    "McapReader",
    "McapWriter",
    "MissingExtra",
    "MissingReference",
    "MvCodecError",
    "MvCodecWarning",
    "NoSuchFrame",
    "OutputError",
    "Packet",
    "PairMatcher",
    "Picture",
    "Plugin",
    "Position",
    "RateControl",
    "Reading",
    "RenderedView",
    "SettingError",
    "StreamClosed",
    "StreamError",
    "StreamHeader",
    "StreamInfo",
    "Synthesizer",
    "Timing",
    "Video",
    "Viewpoint",
    "__version__",
    "encode",
    "make_matcher",
    "make_synthesizer",
    "open",
    "open_input",
    "read_info",
    "setting",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'mvcodec' has no attribute {name!r}")
    found = getattr(import_module(_HOMES[name]), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
