"""`mvcodec join`: segments coded apart are one stream again, packet for packet."""

from __future__ import annotations

import io
import json
from itertools import pairwise
from pathlib import Path

import pytest
from coding import config, encode, encoded_file, frame_set, make_array
from command_line import fails, succeeds
from small_arrays import write_array

from mvcodec.conformance.validation import validate
from mvcodec.container import McapReader, McapWriter, read_info
from mvcodec.container.declared import DROPPED_KEY
from mvcodec.container.joining import join
from mvcodec.encoding.encoder import Encoder
from mvcodec.encoding.keyframe_ratio import STILL_RATIO
from mvcodec.errors import StreamError
from mvcodec.stream import Packet

ARRAY = make_array(48, 32, fps=3.0, rows=1)


def _segment(folder: Path, first: int, stop: int, **changes: object) -> Path:
    """One segment as a file; keyframes come every three frame sets."""
    path = folder / f"{first:04d}.mcap"
    with Encoder(ARRAY, config(**changes), coded_before=first) as encoder, McapWriter(path) as writer:
        for index in range(first, stop):
            writer.push(encoder.push(frame_set(ARRAY, index)))
    return path


def _packets(file: Path | io.BytesIO) -> list[Packet]:
    with McapReader.open(file) as reader:
        return [packet for _, packet in reader.packets()]


@pytest.mark.parametrize(
    ("codec", "cuts"), [("h264", (0, 3, 12)), ("h264", (0, 33, 36, 66, 69, 72)), ("av1", (0, 3, 6))]
)
def test_joined_segments_are_what_one_encoder_writes(
    tmp_path: Path, codec: str, cuts: tuple[int, ...]
) -> None:
    parts = [_segment(tmp_path, first, stop, codec=codec) for first, stop in pairwise(cuts)]
    assert join(parts, tmp_path / "joined.mcap") == cuts[-1]
    whole = [packet for packets in encode(ARRAY, cuts[-1], codec=codec) for packet in packets]
    assert _packets(tmp_path / "joined.mcap") == whole
    assert validate(tmp_path / "joined.mcap") == []


def test_without_the_count_of_what_came_before_packets_differ() -> None:
    with Encoder(ARRAY, config()) as encoder:
        alone = [packet for index in range(3, 6) for packet in encoder.push(frame_set(ARRAY, index))]
    whole = [packet for packets in encode(ARRAY, 6)[3:] for packet in packets]
    assert [packet.data for packet in alone[1:]] != [packet.data for packet in whole[1:]]


def test_what_live_encoders_left_out_is_added_up(tmp_path: Path) -> None:
    parts = []
    for first, dropped in ((0, 2), (3, 5)):
        parts.append(tmp_path / f"{first}.mcap")
        with McapWriter(parts[-1]) as writer:
            for packets in encode(ARRAY, 3, first):
                writer.push(packets)
            writer.note({DROPPED_KEY: str(dropped)})
    target = io.BytesIO()
    join(parts, target)
    assert read_info(io.BytesIO(target.getvalue())).dropped == 7


def test_parts_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    first, second = _segment(tmp_path, 0, 3), _segment(tmp_path, 3, 6)
    target = tmp_path / "out.mcap"
    with pytest.raises(StreamError, match=r"after 0.667 s, where .*0000.mcap ends"):
        join([first, first], target)
    with pytest.raises(StreamError, match=r"0000.mcap: found a start at 0.000 s"):
        join([second, first], target)
    other = tmp_path / "other.mcap"
    other.write_bytes(encoded_file(ARRAY, 3, 3, qp=40))
    with pytest.raises(StreamError, match=r"other.mcap: found settings .*'qp': 40.* as .*0000.mcap has it"):
        join([first, other], target)
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(second.read_bytes()[:-40])
    with pytest.raises(StreamError, match=r"cut.mcap: found a file without an index"):
        join([first, cut], target)
    assert not target.exists()


def test_command_line_codes_segments_and_joins_them(tmp_path: Path) -> None:
    array = write_array(tmp_path / "array", rows=1, cols=2, frames=20)
    options = ("--preset", "veryfast", "--matcher", "sgbm", "--disparity-range", "0,8", "--quiet")
    succeeds("encode", array, tmp_path / "whole.mcap", *options)
    succeeds("encode", array, tmp_path / "a.mcap", "--frames", ":10", *options)
    succeeds("encode", array, tmp_path / "b.mcap", "--frames", "10:", "--continues", "10", *options)
    joined = tmp_path / "joined.mcap"
    said = succeeds("join", tmp_path / "a.mcap", tmp_path / "b.mcap", joined)
    assert "20 frame sets" in said
    assert _packets(joined) == _packets(tmp_path / "whole.mcap")
    assert "clean" in succeeds("validate", joined)
    line = fails(1, "join", tmp_path / "b.mcap", tmp_path / "a.mcap", tmp_path / "no.mcap")
    assert "a.mcap: found a start at 0.000 s" in line
    assert not (tmp_path / "no.mcap").exists()
    assert "PART.mcap" in fails(2, "join", tmp_path / "a.mcap", tmp_path / "a.mcap")
    assert "--continues" in fails(2, "encode", array, tmp_path / "c.mcap", "--continues", "7")


def test_dry_run_says_what_would_be_coded(tmp_path: Path) -> None:
    array = write_array(tmp_path / "array", rows=1, cols=2, frames=12)
    plan = json.loads(
        succeeds("encode", array, tmp_path / "x.mcap", "--dry-run", "--frames", "2:", "--gop", "5")
    )
    low, high = plan.pop("disparity_range_px")
    assert low < high
    assert plan.pop("keyframe_ratio") == STILL_RATIO
    assert plan == {"frames": [2, 12], "fps": 10.0, "gop": 5, "cameras": 2, "size": [96, 64]}
    assert not (tmp_path / "x.mcap").exists()
