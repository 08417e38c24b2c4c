"""libvpx's VP9 with pictures from outside among its references, through its C interface.

`mvcodec.video.vp9_reference` is the face of this; nothing else calls it. FFmpeg's interface hides the control
that sets a reference (VP8_SET_REFERENCE), so that the library is called by itself: the one inside of PyAV's
wheel, else the system's. Its ABI is checked by the library (`vpx_codec_enc_init_ver` refuses another number)
and the layout of the structures by the defaults that it fills in.
"""

from __future__ import annotations

import ctypes as c
import ctypes.util
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mvcodec.errors import MvCodecError, SettingError

I420 = 0x102
GOLDEN, ALTREF = 2, 4
"""vpx_ref_frame_type: the references that a picture from outside can take the place of."""

FORCE_KEY = 1 << 0
NO_LAST, NO_GOLDEN, NO_ALTREF = 1 << 16, 1 << 17, 1 << 21
KEEP_LAST, KEEP_GOLDEN, KEEP_ALTREF = 1 << 18, 1 << 22, 1 << 23
"""Flags of a frame: what it may not refer to, and what it may not replace."""

GOOD_QUALITY = 1_000_000

_SET_REFERENCE, _CPU_USED, _CQ_LEVEL, _FRAME_PARALLEL, _AQ_MODE, _COLOR_SPACE = 1, 13, 25, 35, 36, 46
_BT709 = 2
_CONSTANT_QUALITY = 3
_ABI_MISMATCH = 3
_ENCODER_ABIS = (39, 25, *range(15, 80))
_DECODER_ABIS = (12, *range(5, 40))
"""Numbers that are tried: those of libvpx 1.16 and 1.12 first."""

_DEFAULTS = {"width": 320, "height": 240, "time_den": 30, "max_quantizer": 63, "kf_max_dist": 128}
"""What vpx_codec_enc_config_default has said since VP9 began; other values where fields have moved."""

_CONTEXT_BYTES = 512
"""Room for a vpx_codec_ctx, which has 56."""

Bytes = NDArray[np.uint8]


class LibvpxMissing(MvCodecError):
    """There is no libvpx that can be used."""

    def __init__(self, found: str) -> None:
        super().__init__(f"libvpx: found {found}; install PyAV's wheel (pip install av), or Debian's libvpx7")


class LibvpxError(MvCodecError):
    """libvpx refused what it was given."""


class _Config(c.Structure):
    """vpx_codec_enc_cfg, up to what is used; the library's own is shorter than `rest`."""

    _fields_ = (
        *((name, c.c_uint) for name in ("usage", "threads", "profile", "width", "height")),
        *((name, c.c_uint) for name in ("bit_depth", "input_bit_depth")),
        ("time_num", c.c_int),
        ("time_den", c.c_int),
        ("error_resilient", c.c_uint),
        ("pass_", c.c_int),
        ("lag", c.c_uint),
        *((name, c.c_uint) for name in ("drop", "resize", "scaled_width", "scaled_height", "up", "down")),
        ("end_usage", c.c_int),
        *((name, c.c_size_t) for name in ("stats", "stats_size", "first_pass", "first_pass_size")),
        *((name, c.c_uint) for name in ("bitrate", "min_quantizer", "max_quantizer")),
        *((name, c.c_uint) for name in ("undershoot", "overshoot", "buffer", "buffer_initial")),
        *((name, c.c_uint) for name in ("buffer_optimal", "bias", "min_section", "max_section")),
        ("corpus", c.c_uint),
        ("kf_mode", c.c_int),
        ("kf_min_dist", c.c_uint),
        ("kf_max_dist", c.c_uint),
        ("rest", c.c_ubyte * 4096),
    )


class _Image(c.Structure):
    """vpx_image_t."""

    _fields_ = (
        *((name, c.c_int) for name in ("format", "space", "range")),
        *((name, c.c_uint) for name in ("stored_width", "stored_height", "bit_depth", "width", "height")),
        *((name, c.c_uint) for name in ("render_width", "render_height", "x_shift", "y_shift")),
        ("planes", c.c_void_p * 4),
        ("strides", c.c_int * 4),
        ("bits", c.c_int),
        ("user", c.c_void_p),
        ("data", c.c_void_p),
        ("owner", c.c_int),
        ("self_allocated", c.c_int),
        ("frame_buffer", c.c_void_p),
        ("rest", c.c_ubyte * 128),
    )


class _Reference(c.Structure):
    """vpx_ref_frame_t."""

    _fields_ = (("kind", c.c_int), ("image", _Image))


class _Packet(c.Structure):
    """vpx_codec_cx_pkt_t of kind 0, a coded frame."""

    _fields_ = (("kind", c.c_int), ("data", c.c_void_p), ("size", c.c_size_t))


@cache
def library() -> c.CDLL:
    """The library, loaded once.

    Raises:
        LibvpxMissing: there is none, or one whose structures are not as they are known here.
    """
    for name in places():
        try:
            found = c.CDLL(name)
        except OSError:
            continue
        return checked(found)
    raise LibvpxMissing("none, neither in PyAV's wheel nor in the system")


def checked(found: c.CDLL) -> c.CDLL:
    """The library with its functions declared.

    Raises:
        LibvpxMissing: it has no VP9, or lays its structures out in another way.
    """
    try:
        for name in ("vpx_codec_vp9_cx", "vpx_codec_vp9_dx", "vpx_codec_get_cx_data", "vpx_codec_get_frame"):
            getattr(found, name).restype = c.c_void_p
        for name in ("vpx_codec_version_str", "vpx_codec_err_to_string"):
            getattr(found, name).restype = c.c_char_p
        config = _Config()
        code = found.vpx_codec_enc_config_default(c.c_void_p(found.vpx_codec_vp9_cx()), c.byref(config), 0)
    except AttributeError as error:
        raise LibvpxMissing(f"a library without VP9 ({error})") from None
    said = {name: getattr(config, name) for name in _DEFAULTS}
    if code or said != _DEFAULTS:
        raise LibvpxMissing(f"version {version(found)}, whose structures are not known here")
    return found


def version(found: c.CDLL | None = None) -> str:
    """What the library says of itself, such as ``v1.16.0``."""
    text: bytes = (found or library()).vpx_codec_version_str()
    return text.decode()


class Vp9Encoder:
    """One VP9 encoder at a constant quantiser, one frame in, one frame out.

    Args:
        width, height: px, even.
        quantizer: 0..63.
        speed: 0..8, libvpx's cpu-used.

    Raises:
        LibvpxMissing: see `library`.
        SettingError: the library takes no such pictures.
    """

    def __init__(self, width: int, height: int, quantizer: int, speed: int) -> None:
        self._library, self._size = library(), (width, height)
        config = _Config()
        interface = c.c_void_p(self._library.vpx_codec_vp9_cx())
        self._library.vpx_codec_enc_config_default(interface, c.byref(config), 0)
        config.width, config.height, config.lag, config.threads = width, height, 0, 1
        config.min_quantizer = config.max_quantizer = quantizer
        config.kf_mode, config.end_usage, config.error_resilient = 0, _CONSTANT_QUALITY, 0
        self._context = _opened(
            self._library, "vpx_codec_enc_init_ver", interface, c.byref(config), _ENCODER_ABIS
        )
        for control, value in (
            (_CPU_USED, speed),
            (_CQ_LEVEL, quantizer),
            (_FRAME_PARALLEL, 0),
            (_AQ_MODE, 0),
            (_COLOR_SPACE, _BT709),
        ):
            _call(self._library.vpx_codec_control_(self._context, control, c.c_int(value)), self._library)
        self._count = 0

    def set_reference(self, kind: int, picture: Bytes) -> None:
        """Put a picture (uint8, I420 in one piece) in the place of GOLDEN or ALTREF."""
        _set_reference(self._library, self._context, kind, picture, self._size)

    def encode(self, picture: Bytes, flags: int) -> bytes:
        """Code one picture (uint8, I420 in one piece)."""
        image = _wrapped(self._library, picture, self._size)
        code = self._library.vpx_codec_encode(
            self._context,
            c.byref(image),
            c.c_int64(self._count),
            c.c_ulong(1),
            c.c_long(flags),
            c.c_ulong(GOOD_QUALITY),
        )
        _call(code, self._library)
        self._count += 1
        return b"".join(self._packets())

    def _packets(self) -> Iterator[bytes]:
        state = c.c_void_p(None)
        while found := self._library.vpx_codec_get_cx_data(self._context, c.byref(state)):
            packet = c.cast(found, c.POINTER(_Packet)).contents
            if packet.kind == 0:
                yield c.string_at(packet.data, packet.size)

    def __del__(self) -> None:
        if hasattr(self, "_context"):
            self._library.vpx_codec_destroy(self._context)


class Vp9Decoder:
    """One VP9 decoder, one frame in, one picture out."""

    def __init__(self, width: int, height: int) -> None:
        self._library, self._size = library(), (width, height)
        interface = c.c_void_p(self._library.vpx_codec_vp9_dx())
        self._context = _opened(self._library, "vpx_codec_dec_init_ver", interface, None, _DECODER_ABIS)

    def set_reference(self, kind: int, picture: Bytes) -> None:
        """See `Vp9Encoder.set_reference`."""
        _set_reference(self._library, self._context, kind, picture, self._size)

    def decode(self, data: bytes) -> tuple[Bytes, Bytes, Bytes]:
        """The planes of the one picture that a frame holds, uint8.

        Raises:
            LibvpxError: it is damaged, or another number of pictures of another form.
        """
        code = self._library.vpx_codec_decode(self._context, data, c.c_uint(len(data)), None, c.c_long(0))
        _call(code, self._library)
        state = c.c_void_p(None)
        found = self._library.vpx_codec_get_frame(self._context, c.byref(state))
        if not found:
            raise LibvpxError("no picture")
        image = c.cast(found, c.POINTER(_Image)).contents
        if image.format != I420 or (image.width, image.height) != self._size:
            raise LibvpxError(f"a picture of {image.width}x{image.height}, format {image.format}")
        first, second, third = (_plane(image, number) for number in range(3))
        return first, second, third

    def __del__(self) -> None:
        if hasattr(self, "_context"):
            self._library.vpx_codec_destroy(self._context)


def places() -> Iterator[str]:
    """Where libvpx is looked for: in PyAV's wheel, then in the system."""
    spec = find_spec("av")
    if spec is not None and spec.origin is not None:
        beside = Path(spec.origin).parents[1] / "av.libs"
        yield from map(str, sorted(beside.glob("libvpx*")))
    system = ctypes.util.find_library("vpx")
    if system is not None:
        yield system


def _opened(
    found: c.CDLL, function: str, interface: c.c_void_p, config: object, abis: tuple[int, ...]
) -> c.Array[c.c_ubyte]:
    context = (c.c_ubyte * _CONTEXT_BYTES)()
    for abi in abis:
        code = getattr(found, function)(context, interface, config, c.c_long(0), c.c_int(abi))
        if code == 0:
            return context
        if code != _ABI_MISMATCH:
            raise SettingError("size", _text(found, code), "pictures that libvpx takes")
    raise LibvpxMissing(f"version {version(found)}, whose ABI is not among those known here")


def _text(found: c.CDLL, code: int) -> str:
    text: bytes = found.vpx_codec_err_to_string(code)
    return text.decode()


def _call(code: int, found: c.CDLL) -> None:
    if code:
        raise LibvpxError(_text(found, code))


def _wrapped(found: c.CDLL, picture: Bytes, size: tuple[int, int]) -> _Image:
    """An image whose pixels are the array's, which must outlive it."""
    assert picture.flags.c_contiguous
    assert picture.size == size[0] * size[1] * 3 // 2
    image = _Image()
    found.vpx_img_wrap.restype = c.c_void_p
    if not found.vpx_img_wrap(c.byref(image), I420, *size, 1, c.c_void_p(picture.ctypes.data)):
        raise LibvpxError("no image of this size")
    return image


def _set_reference(
    found: c.CDLL, context: c.Array[c.c_ubyte], kind: int, picture: Bytes, size: tuple[int, int]
) -> None:
    reference = _Reference(kind, _wrapped(found, picture, size))
    _call(found.vpx_codec_control_(context, _SET_REFERENCE, c.byref(reference)), found)


def _plane(image: _Image, number: int) -> Bytes:
    width, height = image.width, image.height
    if number:
        width, height = (width + 1) // 2, (height + 1) // 2
    stride = image.strides[number]
    buffer = (c.c_ubyte * (stride * (height - 1) + width)).from_address(image.planes[number])
    rows = np.lib.stride_tricks.as_strided(np.frombuffer(buffer, np.uint8), (height, width), (stride, 1))
    return rows.copy()
