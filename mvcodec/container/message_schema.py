"""How the messages of a topic are written: their schema's name, their encoding and their definition."""

from __future__ import annotations

from dataclasses import dataclass

ROS1 = "ros1"
ROS2 = "cdr"


class DamagedMessage(Exception):
    """A message that is not what its schema says. (Caught in this package.)"""


@dataclass(frozen=True, slots=True)
class MessageSchema:
    """What a file declares of a topic's messages.

    Attributes:
        name: of the schema; empty where the topic has none.
        encoding: of the messages: protobuf, json, cdr (ROS 2), ros1, ...
        language: of the definition: protobuf, jsonschema, ros2msg, ros2idl, ...
        definition: in that language; other names of schemas and their fields.
    """

    name: str
    encoding: str
    language: str = ""
    definition: bytes = b""

    @property
    def kind(self) -> str:
        """The name without ROS 2's middle part: `sensor_msgs/msg/Image` and `sensor_msgs/Image` are one."""
        package, _, rest = self.name.partition("/")
        return f"{package}/{rest.removeprefix('msg/')}" if rest else self.name

    def __str__(self) -> str:
        encoding = {ROS1: "ROS 1", ROS2: "ROS 2"}.get(self.encoding, self.encoding or "nothing")
        return f"{self.name or 'no schema'} as {encoding}"
