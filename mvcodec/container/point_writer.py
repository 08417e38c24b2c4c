"""Points -> an MCAP file of Foxglove's point clouds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap_protobuf.schema import build_file_descriptor_set
from numpy.typing import NDArray

from mvcodec.closing import Closing
from mvcodec.container.chunk_writing import ChunkedFile
from mvcodec.container.schemas import RIG_FRAME

POINTS_TOPIC = "/points"

_POINT = np.dtype([("place", "<f4", 3), ("colour", "u1", 4)])

_FIELDS = [
    PackedElementField(name=name, offset=offset, type=kind)
    for kind, names, start, size in (
        (PackedElementField.NumericType.FLOAT32, ("x", "y", "z"), 0, 4),
        (PackedElementField.NumericType.UINT8, ("red", "green", "blue", "alpha"), 12, 1),
    )
    for offset, name in ((start + size * number, name) for number, name in enumerate(names))
]


class PointWriter(Closing):
    """Writes point clouds on `/points`, in the frame `rig`, one for each frame set.

    Raises:
        OutputError: the system refuses to open or write.
    """

    def __init__(self, target: Path) -> None:
        self._file = ChunkedFile(target)

    def push(
        self, index: int, time_ns: int, places_m: NDArray[np.float32], colours: NDArray[np.uint8]
    ) -> None:
        """Write the points of one time: float32 (N, 3) metres, uint8 (N, 3) RGB."""
        if not self._file.is_open:
            self._file.open()
            schema = build_file_descriptor_set(PointCloud).SerializeToString()
            name = PointCloud.DESCRIPTOR.full_name
            channel = (MessageEncoding.Protobuf, name, SchemaEncoding.Protobuf, schema)
            self._file.add_channel(POINTS_TOPIC, *channel)
        packed = np.zeros(len(places_m), _POINT)
        packed["place"] = places_m
        packed["colour"][:, :3], packed["colour"][:, 3] = colours, 255
        message = PointCloud(
            frame_id=RIG_FRAME, point_stride=_POINT.itemsize, fields=_FIELDS, data=packed.tobytes()
        )
        message.timestamp.FromNanoseconds(time_ns)
        message.pose.orientation.w = 1.0
        self._file.begin_set(time_ns, keyframe=False)
        self._file.add(POINTS_TOPIC, index, time_ns, message.SerializeToString())
        self._file.end_set()

    def close(self) -> None:
        """Complete the file."""
        self._file.close()
