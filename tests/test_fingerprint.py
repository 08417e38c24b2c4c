"""What the keys of measured points are made of, and the versions that points keep."""

from __future__ import annotations

import importlib.metadata
import json
import platform
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from coding import RANGE_PX
from small_arrays import write_array
from study_runs import study_run

from mvcodec.capture import open_input
from mvcodec.evaluation import fingerprint
from mvcodec.evaluation.fingerprint import examine, measuring_versions
from mvcodec.evaluation.study import StudyRun
from mvcodec.video.codecs import CODECS
from mvcodec.video.pyav import library_versions


def keys(run: StudyRun) -> tuple[str, str]:
    """Of a point of mvcodec's own curve and of an anchor's."""
    own, anchor = (run.store.name(run.depends_on(curve, 30)) for curve in run.study.curves[:2])
    return own, anchor


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of mvcodec's sources that keys are made of."""
    copied = shutil.ignore_patterns("__pycache__")
    folder = Path(shutil.copytree(fingerprint.PACKAGE, tmp_path / "package", ignore=copied))
    monkeypatch.setattr(fingerprint, "PACKAGE", folder)
    return folder


def test_a_point_hangs_on_the_choice_that_the_model_makes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = study_run(tmp_path, RANGE_PX)
    before = keys(run)
    assert before == keys(run)
    other = replace(CODECS["h264"], maps=replace(CODECS["h264"].maps, full=11, half=7))
    monkeypatch.setitem(CODECS, "h264", other)
    after = keys(run)
    assert before[0] != after[0]
    assert before[1] == after[1]


def test_a_point_without_a_stated_range_can_be_named(tmp_path: Path) -> None:
    assert len(set(keys(study_run(tmp_path, None)))) == 2


@pytest.mark.parametrize("name", fingerprint.LIBRARIES)
def test_our_own_points_hang_on_the_libraries_that_they_were_made_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    run = study_run(tmp_path, RANGE_PX)
    before, installed = keys(run), importlib.metadata.version
    monkeypatch.setattr(
        importlib.metadata, "version", lambda asked: installed(asked) + ".9" * (asked == name)
    )
    after = keys(run)
    assert before[0] != after[0]
    assert before[1] == after[1], "anchors rest on FFmpeg, not on the matcher's libraries"


@pytest.mark.parametrize(
    ("file", "changed"),
    [
        ("evaluation/metrics.py", (True, True)),
        ("video/colour.py", (True, True)),
        ("synthesis/linear.py", (True, False)),
        ("evaluation/page.py", (False, False)),
    ],
)
def test_points_hang_on_the_code_that_makes_them(
    tmp_path: Path, package: Path, file: str, changed: tuple[bool, bool]
) -> None:
    before = keys(study_run(tmp_path / "a", RANGE_PX))
    with (package / file).open("a") as source:
        source.write("# other\n")
    after = keys(study_run(tmp_path / "a", RANGE_PX))
    assert tuple(a != b for a, b in zip(before, after, strict=True)) == changed


def test_pictures_are_known_apart_from_what_else_an_array_says(tmp_path: Path) -> None:
    folders = (
        write_array(tmp_path / "a", 2, 2, 2),
        write_array(tmp_path / "b", 2, 2, 2, real=[(0, 0), (1, 1)]),
        write_array(tmp_path / "c", 2, 2, 2),
    )
    shutil.copy(folders[2] / "r00_c00" / "000000.png", folders[2] / "r01_c01" / "000001.png")
    facts = [examine(open_input([folder]), range(2)) for folder in folders]
    assert facts[0].pictures == facts[1].pictures != facts[2].pictures
    assert len({found.digest for found in facts}) == 3


def test_a_point_keeps_the_versions_that_it_was_made_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = study_run(tmp_path, RANGE_PX)
    assert all(point.versions == measuring_versions() for point in run.measure()["simulcast"])
    monkeypatch.setattr(platform, "python_version", lambda: "9.9")
    assert measuring_versions()["python"] == "9.9"
    assert all(point.versions["python"] != "9.9" for point in run.measure()["simulcast"])


def test_a_point_that_does_not_state_its_versions_has_those_of_its_key(tmp_path: Path) -> None:
    run = study_run(tmp_path, RANGE_PX)
    run.measure()
    anchor = run.study.curves[1]
    path = run.store.folder / f"{run.store.name(run.depends_on(anchor, 30))}.json"
    document = json.loads(path.read_text())
    del document["point"]["versions"]
    path.write_text(json.dumps(document))
    before = path.stat().st_mtime_ns
    assert run.measure()[anchor.name][0].versions == library_versions()
    assert path.stat().st_mtime_ns == before
