"""MCAP recordings as other people's recorders write them: one topic of pictures for each camera."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
from coding import frame_set, make_array
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from mcap_protobuf.writer import Writer
from PIL import Image

from mvcodec.array import Position
from mvcodec.frames import Picture
from mvcodec.stream import TrackKind
from mvcodec.video.codec import RateControl, VideoSettings
from mvcodec.video.codecs import find_codec
from mvcodec.video.colour import to_planes

ARRAY = make_array(96, 64, fps=10.0)
TOPICS = {camera: f"/cam{camera[0]}{camera[1]}" for camera in ARRAY.real}
GRID = "/cam00,/cam01;/cam10,/cam11"
START_NS = 1_700_000_000_000_000_000


def _raw(encoding: str, order: Callable[[Picture], Any], padding: int = 0) -> Callable[[Picture], Any]:
    def message(picture: Picture) -> Any:
        pixels = order(picture)
        rows = np.ascontiguousarray(pixels).reshape(picture.shape[0], -1)
        rows = np.pad(rows, ((0, 0), (0, padding)))
        height, width = picture.shape[:2]
        return RawImage(
            width=width, height=height, encoding=encoding, step=rows.shape[1], data=rows.tobytes()
        )

    return message


def _image(form: str) -> Callable[[Picture], Any]:
    def message(picture: Picture) -> Any:
        target = io.BytesIO()
        Image.fromarray(picture).save(target, form, **({"quality": 95} if form == "jpeg" else {}))
        return CompressedImage(data=target.getvalue(), format=form)

    return message


def _video() -> Callable[[Picture], Any]:
    settings = VideoSettings(TrackKind.TEXTURE, 96, 64, 10.0, 10, RateControl(qp=10), "veryfast")
    encoder = find_codec("h264").encoder(settings)

    def message(picture: Picture) -> Any:
        (coded,) = encoder.push(to_planes(picture))
        return CompressedVideo(data=coded.data, format="h264")

    return message


FORMS: dict[str, Callable[[], Callable[[Picture], Any]]] = {
    "video": _video,
    "png": lambda: _image("png"),
    "jpeg": lambda: _image("jpeg"),
    "rgb8": lambda: _raw("rgb8", lambda picture: picture),
    "bgr8": lambda: _raw("bgr8", lambda picture: picture[..., ::-1], padding=5),
    "rgba8": lambda: _raw("rgba8", lambda picture: np.dstack([picture, picture[..., :1]])),
    "mono8": lambda: _raw("mono8", lambda picture: picture[..., 1]),
}
"""Name -> what makes the message of a camera's next picture (without time)."""


def shots(count: int, jitter_ns: int = 0) -> Iterator[tuple[int, Position, int]]:
    """(frame, camera, time) of every picture, cameras a little apart."""
    for index in range(count):
        for number, camera in enumerate(ARRAY.real):
            yield index, camera, START_NS + index * 100_000_000 + number * jitter_ns


def recording(form: str, taken: Iterable[tuple[int, Position, int]]) -> bytes:
    """A recording of pictures in a form."""
    target = io.BytesIO()
    makers = {camera: FORMS[form]() for camera in ARRAY.real}
    with Writer(target) as writer:
        for index, camera, time_ns in taken:
            message = makers[camera](frame_set(ARRAY, index).pictures[camera])
            message.timestamp.FromNanoseconds(time_ns)
            message.frame_id = f"frame{camera}"
            writer.write_message(TOPICS[camera], message, time_ns, time_ns)
    return target.getvalue()
