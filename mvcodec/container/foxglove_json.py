"""Foxglove's messages in JSON -> the same as protobuf.

Bytes are base64, times are seconds and nanoseconds.
"""

from __future__ import annotations

import json
from typing import Any

from google.protobuf.json_format import ParseDict, ParseError
from google.protobuf.timestamp_pb2 import Timestamp

from mvcodec.container.message_schema import DamagedMessage

_TIME = "timestamp"


def from_json(data: bytes, message: Any) -> Any:
    """Fill an empty protobuf message with what a message in JSON says; returns it.

    Raises:
        DamagedMessage: not JSON, or fields of other types.
    """
    try:
        document = json.loads(data)
        if not isinstance(document, dict):
            raise DamagedMessage("no JSON object")
        times = [document, *(item for item in document.get("transforms", ()) if isinstance(item, dict))]
        for holder in times:
            if isinstance(holder.get(_TIME), dict):
                holder[_TIME] = _time_text(holder[_TIME])
        return ParseDict(document, message, ignore_unknown_fields=True)
    except (ParseError, ValueError, TypeError, RecursionError, OverflowError) as error:
        raise DamagedMessage(" ".join(str(error).split())[:200]) from None


def _time_text(time: dict[str, Any]) -> str:
    """As protobuf's JSON has it."""
    return str(Timestamp(seconds=int(time.get("sec", 0)), nanos=int(time.get("nsec", 0))).ToJsonString())
