"""`mvcodec validate`, alone and beside independent checkers of MCAP files and of video in them."""

from __future__ import annotations

import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from broken_files import BROKEN, BROKEN_CONTAINERS, coded_sets, written
from coding import encode, make_array
from command_line import mvcodec, succeeds
from damage import chunk_ends, small_file

from mvcodec.conformance.validation import validate
from mvcodec.errors import InputError
from mvcodec.video.codecs import CODECS

CONFORMANCE = sorted((Path(__file__).parent / "conformance").glob("*.mcap"))
BIN = Path(sys.executable).parent
DOCTOR, FRAMES = BIN / "pymcap-cli", BIN / "mcap-frames"
GRAVE = ("error", "warning")
CLEAN = ("clean", "odd", "slow", "halved")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Every broken file, and clean ones."""
    folder = tmp_path_factory.mktemp("files")
    for name, (make, _) in BROKEN.items():
        (folder / f"{name}.mcap").write_bytes(make())
    (folder / "clean.mcap").write_bytes(small_file())
    (folder / "odd.mcap").write_bytes(written(encode(make_array(33, 17, fps=25.0), 30, qp=20)))
    (folder / "slow.mcap").write_bytes(written(coded_sets(5, 1, fps=0.5)))
    halved = encode(make_array(96, 64, rows=1, cols=2), 12, gop=5, disparity_scale=2)
    (folder / "halved.mcap").write_bytes(written(halved))
    return folder


@pytest.mark.parametrize("codec", CODECS)
def test_what_the_encoder_writes_is_clean(codec: str, tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(written(encode(make_array(96, 64, rows=1, cols=2), 12, gop=5, codec=codec)))
    assert validate(path) == []


def test_files_of_earlier_versions_are_clean(folder: Path) -> None:
    for path in (*CONFORMANCE, *(folder / f"{name}.mcap" for name in CLEAN)):
        assert validate(path) == [], path


@pytest.mark.parametrize("name", BROKEN)
def test_each_broken_rule_is_found(folder: Path, name: str) -> None:
    findings = validate(folder / f"{name}.mcap")
    assert BROKEN[name][1] in {finding.code for finding in findings}


def test_findings_name_topic_and_time(folder: Path) -> None:
    (found,) = validate(folder / "frame_id.mcap")
    assert (found.topic, found.time_ns) == ("/camera/r00_c01/video", 500_000_000)
    assert found.message == "frame_id 'somewhere', expected 'camera_r00_c01'"
    (missing, *later) = validate(folder / "missing_packet.mcap")
    assert (missing.topic, missing.time_ns, missing.code) == (
        "/camera/r00_c01/video",
        500_000_000,
        "incomplete",
    )
    assert {finding.code for finding in later} == {"missing-reference"}


def test_order_and_damaged_chunks_name_topic_and_time_as_decode_does(folder: Path) -> None:
    found = [finding for finding in validate(folder / "same_time.mcap") if finding.code == "order"]
    assert [(f.topic, f.time_ns, f.severity) for f in found] == [
        ("/camera/r00_c00/video", 500_000_000, "error")
    ]
    assert found[0].message == "a time not after that of frame 5, expected times that increase"
    found = [finding for finding in validate(folder / "out_of_order.mcap") if finding.code == "order"]
    assert {(f.topic, f.time_ns) for f in found} >= {("/camera/r00_c00/video", 500_000_000)}
    content = bytearray(small_file())
    content[chunk_ends(bytes(content))[2] - 100] ^= 16
    path = folder.parent / "flipped.mcap"
    path.write_bytes(content)
    (chunk,) = validate(path)
    assert (chunk.code, chunk.topic, chunk.time_ns) == ("chunk", "/camera/r00_c00/calibration", 10**9)
    assert "/camera/r00_c00/calibration and 7 more topics, 1.000..1.400 s" in chunk.message


def test_a_damaged_message_index_names_its_topic(folder: Path) -> None:
    (found,) = (f for f in validate(folder / "message_index.mcap") if f.code == "message-index")
    assert found.topic == "/mvcodec/header"


def test_the_command_prints_findings_and_says_by_its_exit_code(folder: Path) -> None:
    clean = folder / "clean.mcap"
    assert succeeds("validate", clean) == f"{clean}: clean\n"
    assert json.loads(succeeds("validate", clean, "--json")) == {
        "file": str(clean),
        "kind": "array",
        "clean": True,
        "findings": [],
    }
    broken = folder / "frame_id.mcap"
    done = mvcodec("validate", broken)
    assert done.returncode == 1
    assert done.stdout.startswith("error: /camera/r00_c01/video at 0.500 s: frame_id 'somewhere'")
    assert done.stderr == f"mvcodec: error: {broken}: 1 error, 0 warnings\n"
    document = json.loads(mvcodec("validate", broken, "--json").stdout)
    assert document["clean"] is False
    assert document["findings"] == [
        {
            "severity": "error",
            "code": "frame-id",
            "topic": "/camera/r00_c01/video",
            "time_s": 0.5,
            "message": "frame_id 'somewhere', expected 'camera_r00_c01'",
        }
    ]


def test_what_cannot_be_opened_and_what_is_no_mcap(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        validate(tmp_path / "none.mcap")
    for content in (b"", b"text " * 50):
        (tmp_path / "x.mcap").write_bytes(content)
        assert "magic" in {finding.code for finding in validate(tmp_path / "x.mcap")}


def _doctor(path: Path) -> list[str]:
    """The grave findings of pymcap-cli doctor."""
    done = subprocess.run(
        [DOCTOR, "doctor", "--format", "jsonl", "--strict-message-order", path],
        capture_output=True,
        text=True,
        check=False,
    )
    lines = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    grave = [str(line["code"]) for line in lines if line.get("severity") in GRAVE]
    assert grave or done.returncode == 0, done.stderr
    return grave


def _frames_check(paths: list[Path], report: Path) -> dict[str, list[str]]:
    """The grave issues of mcap-frames check, file by file."""
    done = subprocess.run(
        [FRAMES, "check", "--json", report, *paths], capture_output=True, text=True, check=False
    )
    assert report.exists(), done.stderr
    reports: Any = json.loads(report.read_text())
    return {
        Path(one["file"]).stem: [
            issue["code"]
            for topic in one.get("topics", {}).values()
            for issue in topic["issues"]
            if issue["level"] in GRAVE
        ]
        for one in reports
    }


def _compare(folder: Path, names: list[str], report: Path) -> set[str]:
    """Check files by all three; returns those that the others find fault with."""
    paths = [folder / f"{name}.mcap" for name in names]
    with ThreadPoolExecutor(2) as pool:
        theirs = {path.stem for path, found in zip(paths, pool.map(_doctor, paths), strict=True) if found}
    # On damaged containers mcap-frames gives up without a report.
    issues = _frames_check([path for path in paths if path.stem not in BROKEN_CONTAINERS], report)
    theirs |= {name for name, found in issues.items() if found}
    assert theirs <= {path.stem for path in paths if validate(path)}
    assert not {*CLEAN} & theirs
    return theirs


def test_independent_checkers_agree(folder: Path, tmp_path: Path) -> None:
    """They find our files clean; and what they find fault with, we do too."""
    names = ["clean", "halved", "chunk", "missing_set", "missing_keyframe"]
    assert _compare(folder, names, tmp_path / "r.json") == {"chunk", "missing_set", "missing_keyframe"}


@pytest.mark.slow
def test_independent_checkers_agree_on_every_kind_of_damage(folder: Path, tmp_path: Path) -> None:
    theirs = _compare(folder, sorted(path.stem for path in folder.glob("*.mcap")), tmp_path / "r.json")
    assert len(theirs) >= 15, "the comparison is about something"
