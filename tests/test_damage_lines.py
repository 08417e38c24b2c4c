"""What the command line says of damage: all of it, but not a line for each packet."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

from broken_files import coded_sets, written
from command_line import fails, mvcodec
from damage import COUNT, GOP, chunk_ends, small_file

from mvcodec.cli.warning_lines import SHOWN
from mvcodec.container import read_info


def _all_at_one_time(path: Path, count: int) -> Path:
    sets = [[replace(packet, time_ns=0) for packet in packets] for packets in coded_sets(count)]
    path.write_bytes(written(sets))
    return path


def test_warnings_of_one_kind_are_counted_beyond_the_first_few(tmp_path: Path) -> None:
    path = _all_at_one_time(tmp_path / "x.mcap", 30)
    done = mvcodec("decode", path, tmp_path / "out", "--quiet", "--on-error", "skip")
    assert done.returncode == 0
    lines = done.stderr.splitlines()
    assert len(lines) == SHOWN + 1
    assert all("found a time not after that of frame" in line for line in lines)
    assert lines[-1].startswith(f"mvcodec: warning: {29 - SHOWN} more like this: {path}: frame 1 at 0.000 s")
    assert len(set(lines)) == len(lines)


def test_warnings_of_few_places_are_all_shown_and_each_topic_is_a_kind_of_its_own(tmp_path: Path) -> None:
    path = _all_at_one_time(tmp_path / "x.mcap", SHOWN + 1)
    lines = mvcodec("decode", path, tmp_path / "out", "--quiet", "--on-error", "skip").stderr.splitlines()
    assert [re.search(r"frame (\d+) at", line)[1] for line in lines] == [str(n + 1) for n in range(SHOWN)]  # type: ignore[index]
    sets = [
        [packet for packet in packets if packet.index % 2 or packet.track.camera != (0, index // 2 % 2)]
        for index, packets in enumerate(coded_sets(24, gop=1))
    ]
    path.write_bytes(written(sets))
    lines = mvcodec("decode", path, tmp_path / "out", "--quiet", "-y").stderr.splitlines()
    for camera in ("r00_c00", "r00_c01"):
        gone = [line for line in lines if f"/camera/{camera}/video" in line]
        assert len(gone) == SHOWN + 1
        assert "1 more like this" in gone[-1]


def test_info_counts_what_can_be_read_and_tells_the_damage(tmp_path: Path) -> None:
    content = bytearray(small_file())
    content[chunk_ends(bytes(content))[2] - 100] ^= 16
    path = tmp_path / "flipped.mcap"
    path.write_bytes(content)
    done = mvcodec("info", path)
    assert done.returncode == 0
    (line,) = done.stderr.splitlines()
    assert line.startswith("mvcodec: warning: ")
    assert "/camera/r00_c00/calibration and 7 more topics at 1.000..1.400 s: found damage" in line
    assert done.stdout.startswith(f"{path}: {COUNT - GOP} frame sets of 2 cameras")
    assert "damage       in 1 place" in done.stdout
    document = json.loads(mvcodec("info", path, "--json").stdout)
    assert (document["frames"], document["damages"]) == (COUNT - GOP, 1)
    path.write_bytes(small_file())
    assert (read_info(path).frames, read_info(path).damages) == (COUNT, 0)
    path.write_bytes(content[:200])
    assert "cut off before its first frame set" in fails(1, "info", path)
