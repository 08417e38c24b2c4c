"""`mvcodec batch` and `evaluate --cluster`: the workers of a real scheduler give what one process gives."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import fsspec
import pytest
from command_line import COMMAND, fails, mvcodec, succeeds
from dask_cluster import kill_a_busy_worker, running_cluster, wait_for
from small_arrays import write_array

from mvcodec.cluster.batch_inputs import find_recordings
from mvcodec.cluster.connection import check_cluster
from mvcodec.cluster.frame_segments import cut
from mvcodec.cluster.places import Place
from mvcodec.errors import InputError, SettingError

pytest_plugins = ("ctrl_c",)

QUICK = ("--preset", "veryfast", "--matcher", "sgbm", "--qp", "30")
FRAMES = 40
"""Four GOPs of ten frames."""


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a scheduler with two workers."""
    with running_cluster(tmp_path_factory.mktemp("dask")) as address:
        yield address


@pytest.fixture(scope="module")
def array(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An array folder of two cameras."""
    return write_array(tmp_path_factory.mktemp("in") / "room", rows=1, cols=2, frames=FRAMES)


@pytest.fixture(scope="module")
def whole(array: Path, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The array as one process codes it."""
    path = tmp_path_factory.mktemp("whole") / "whole.mcap"
    succeeds("encode", array, path, *QUICK, "--quiet")
    return path.read_bytes()


def _files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def test_segments_give_the_file_of_one_process_though_a_worker_is_killed(
    cluster: str, array: Path, whole: bytes, tmp_path: Path
) -> None:
    output = tmp_path / "out"
    options = ("--output", output, "--cluster", cluster, "--segment", "1s", *QUICK)
    started = subprocess.Popen(
        [*COMMAND, "batch", "encode", array, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    kill_a_busy_worker(cluster)
    printed, said = started.communicate()
    assert started.returncode == 0, said
    assert b"1 recording done" in printed
    assert (output / "room.mcap").read_bytes() == whole
    assert _files(output) == {"room.mcap", "batch/room.json"}
    record = json.loads((output / "batch" / "room.json").read_bytes())
    assert record["command"] == "encode"
    assert record["last_task"]["result"]["frames"] == FRAMES


@pytest.mark.slow
@pytest.mark.usefixtures("heeding_ctrl_c")
def test_ctrl_c_leaves_finished_segments_and_the_next_run_uses_them(
    cluster: str, array: Path, whole: bytes, tmp_path: Path
) -> None:
    output = tmp_path / "out"
    command = ("batch", "encode", array, "--output", output, "--cluster", cluster, "--segment", "1s", *QUICK)
    started = subprocess.Popen([*COMMAND, *map(str, command)], stderr=subprocess.PIPE)
    wait_for(lambda: any(output.glob("batch/*/00000000-*.mcap")), "the first segment")
    started.send_signal(signal.SIGINT)
    _, said = started.communicate()
    assert started.returncode == 1
    assert said.decode().splitlines()[-1] == "mvcodec: error: interrupted"
    assert not (output / "room.mcap").exists()
    kept = sorted(output.glob("batch/*/*.mcap"))
    assert kept
    times = [path.stat().st_mtime_ns for path in kept]
    wait_for(lambda: not list(output.glob("**/.*.part")), "the end of what ran")
    # A segment that was made again would be a new file; joining removes them, so their times are seen before.
    assert [path.stat().st_mtime_ns for path in kept] == times
    succeeds(*command)
    assert (output / "room.mcap").read_bytes() == whole
    assert _files(output) == {"room.mcap", "batch/room.json"}
    again = json.loads(succeeds(*command, "--json"))
    assert [job["state"] for job in again] == ["there before"]
    line = fails(1, *command[:-1], "31")
    assert "room.mcap: cannot be written: it is there and was not made from this input" in line


def test_a_recording_that_fails_does_not_keep_the_others(cluster: str, whole: bytes, tmp_path: Path) -> None:
    (tmp_path / "good.mcap").write_bytes(whole)
    (tmp_path / "bad.mcap").write_bytes(b"no MCAP at all")
    options = ("--format", "array", "--output", tmp_path / "views", "--cluster", cluster, "--segment", "2s")
    done = mvcodec("batch", "decode", tmp_path / "*.mcap", *options)
    assert done.returncode == 1
    lines = done.stderr.splitlines()
    assert lines[0].startswith(f"mvcodec: warning: {tmp_path / 'bad.mcap'}: ")
    assert lines[-1] == "mvcodec: error: 1 of 2 recordings failed; the same command tries again"
    assert not (tmp_path / "views" / "bad").exists()
    folders = sorted((tmp_path / "views" / "good").iterdir())
    assert [folder.name for folder in folders] == ["00000000-00000020", "00000020-00000040"]
    assert json.loads((folders[1] / "array.json").read_bytes())["first_frame"] == 20


def test_validate_tells_of_each_file(cluster: str, whole: bytes, tmp_path: Path) -> None:
    (tmp_path / "room.mcap").write_bytes(whole)
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    files = (tmp_path / "room.mcap", tmp_path / "cut.mcap")
    succeeds("batch", "validate", *files, "--output", tmp_path / "v", "--cluster", cluster)
    clean = [json.loads((tmp_path / "v" / f"{file.stem}.json").read_bytes())["clean"] for file in files]
    assert clean == [True, False]


def test_evaluate_measures_the_same_points_and_goes_on_where_it_stopped(cluster: str, tmp_path: Path) -> None:
    array = write_array(tmp_path / "small", rows=1, cols=3, frames=2)
    coding = ("--preset", "veryfast", "--matcher", "sgbm", "--qp", "30,40")
    options = (*coding, "--anchor-codecs", "h264", "--anchors", "simulcast", "--quiet")
    alone, shared = tmp_path / "alone", tmp_path / "shared"
    succeeds("evaluate", array, "--output", alone, *options)
    kept = max((alone / "points").glob("*.json"), key=lambda path: "simulcast" in path.read_text())
    (shared / "points").mkdir(parents=True)
    here = Path(shutil.copy2(kept, shared / "points"))
    succeeds("evaluate", array, "--output", shared, *options, "--cluster", cluster)
    assert here.stat().st_mtime_ns == kept.stat().st_mtime_ns  # not measured again
    assert len(_points(alone)) >= 4
    assert _points(shared) == _points(alone)


def _points(report: Path) -> list[tuple[str, int, int, float]]:
    document = json.loads((report / "report.json").read_bytes())
    return [
        (curve["name"], point["qp"], point["bits"], point["psnr_y"]["all"])
        for curve in document["curves"]
        for point in curve["points"]
    ]


def test_object_stores_hold_inputs_and_outputs(
    array: Path, whole: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    moto_server = pytest.importorskip("moto.server")
    server = moto_server.ThreadedMotoServer(ip_address="127.0.0.1", port=0)
    server.start()
    host, port = server.get_host_and_port()
    for name, value in {
        "FSSPEC_S3_ENDPOINT_URL": f"http://{host}:{port}",
        "FSSPEC_S3_KEY": "none",
        "FSSPEC_S3_SECRET": "none",
    }.items():
        monkeypatch.setenv(name, value)
    try:
        store = fsspec.filesystem(
            "s3", endpoint_url=f"http://{host}:{port}", key="none", secret="none", skip_instance_cache=True
        )
        store.mkdir("inputs")
        store.mkdir("outputs")
        store.put(str(array), "inputs/room", recursive=True)
        # Workers know the server by their environment: a local cluster has this one's.
        options = ("--output", "s3://outputs/coded", "--cluster", "local:2", "--segment", "2s", *QUICK)
        succeeds("batch", "encode", "s3://inputs/room", *options)
        assert store.cat_file("outputs/coded/room.mcap") == whole
        assert sorted(store.find("outputs")) == ["outputs/coded/batch/room.json", "outputs/coded/room.mcap"]
        one_worker = ("local:1" if option == "local:2" else option for option in options)
        again = json.loads(succeeds("batch", "encode", "s3://inputs/room", *one_worker, "--json"))
        assert [job["state"] for job in again] == ["there before"]
    finally:
        server.stop()


@pytest.mark.parametrize("frames", [range(1), range(7, 100), range(300)])
@pytest.mark.parametrize("seconds", [None, 0.01, 1.0, 7.5])
def test_segments_hold_every_frame_once_and_begin_at_keyframes(frames: range, seconds: float | None) -> None:
    found = cut(frames, 10, 10.0, seconds)
    assert [frame for segment in found for frame in segment] == list(frames)
    assert all((segment.start - frames.start) % 10 == 0 for segment in found)
    assert seconds is None or all(len(segment) <= max(10, 10 * seconds + 5) for segment in found)


def test_recordings_come_by_path_pattern_and_manifest(tmp_path: Path) -> None:
    for name in ("a", "b c"):
        write_array(tmp_path / name, rows=1, cols=2, frames=1)
    found = find_recordings([str(tmp_path / "a" / "array.json"), str(tmp_path / "b*")])
    assert [recording.name for recording in found] == ["a", "b c"]
    manifest = tmp_path / "list.csv"
    manifest.write_text("input,name\na,first\nb c,\n")
    assert [recording.name for recording in find_recordings([str(manifest)])] == ["first", "b c"]
    with pytest.raises(InputError, match="under one name, a, expected other names"):
        find_recordings([str(tmp_path / "a"), str(tmp_path / "a" / "array.json")])
    manifest.write_text("input\nnowhere\n")
    with pytest.raises(InputError, match=r"list.csv, line 2: found nowhere, where nothing is"):
        find_recordings([str(manifest)])
    manifest.write_text("path\na\n")
    with pytest.raises(InputError, match="found columns path, expected a column `input`"):
        find_recordings([str(manifest)])
    with pytest.raises(InputError, match="nothing that matches"):
        find_recordings([str(tmp_path / "z*")])


def test_errors_are_one_line_each(tmp_path: Path, array: Path) -> None:
    output = ("--output", tmp_path / "out")
    assert "tcp://host:8786" in fails(2, "batch", "encode", array, *output, "--cluster", "everywhere")
    assert "a running Dask scheduler" in fails(
        1, "batch", "encode", array, *output, "--cluster", "tcp://127.0.0.1:9"
    )
    assert "--qp" in fails(2, "batch", "encode", array, *output, "--qp", "none")
    assert "10s or 2min" in fails(2, "batch", "encode", array, *output, "--segment", "long")
    assert "nothing there" in fails(1, "batch", "encode", tmp_path / "none", *output)
    assert "protocol not known" in fails(1, "batch", "encode", "gopher://x/y", *output).lower()
    with pytest.raises(SettingError):
        check_cluster("local:0")
    with pytest.raises(InputError):
        Place(str(tmp_path / "none")).fingerprint()
