"""One MCAP file: writer, reader, and what a file holds."""

from mvcodec.container.file_facts import Bits, StreamInfo, read_info
from mvcodec.container.reader import McapReader
from mvcodec.container.writer import McapWriter

__all__ = ["Bits", "McapReader", "McapWriter", "StreamInfo", "read_info"]
