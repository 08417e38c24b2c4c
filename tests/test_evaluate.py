"""`mvcodec evaluate` and `tools/rd_plot.py` on small arrays, each in a process of its own."""

from __future__ import annotations

import csv
import io
import json
import re
import shutil
import subprocess
import sys
from contextlib import redirect_stderr
from pathlib import Path

import pytest
import rd_plot
from browser_page import CHROMIUM, NO_CHROMIUM
from command_line import mvcodec, succeeds
from evaluate_reports import FAST, point_times, report
from playwright.sync_api import Page
from small_arrays import write_array

from mvcodec.capture.picture_files import read_picture
from mvcodec.container import read_info

pytest_plugins = ("web_fixtures",)

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def array(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_array(tmp_path_factory.mktemp("arrays") / "small", 2, 3, frames=2)


@pytest.fixture(scope="module")
def measured(array: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("reports") / "first"
    printed = succeeds("evaluate", array, "--output", folder, "--qp", "42,30,24,36", *FAST)
    assert "PVS, all views, AV1" in printed
    return folder


def test_report_has_the_documented_form(array: Path, measured: Path) -> None:
    document = report(measured)
    assert document["path"] == str(array)
    assert document["grid"] == [2, 3]
    assert document["real"] == [[0, 0], [0, 2], [1, 0], [1, 2]]
    assert document["frames"] == 2
    orders = ("simulcast", "simulcast-b", "pvs", "pvs-rows")
    anchors = [f"{order}{codec}" for codec in ("", "-hevc", "-av1") for order in orders]
    assert [curve["name"] for curve in document["curves"]] == ["mvcodec", *anchors]
    assert list(document["bd_rate"]) == anchors
    for curve in document["curves"]:
        assert len(curve["points"]) == 4
        for point in curve["points"]:
            assert point["kbps"] == pytest.approx(point["bits"] * 10.0 / 2 / 1000)
            assert list(point["bits_split"]) == ["texture", "disparity", "rest", "enhancement"]
            assert sum(point["bits_split"].values()) == point["bits"]
            for figures, top in ((point["psnr_y"], 60), (point["psnr_yuv"], 60), (point["ssim"], 1)):
                assert list(figures) == ["all", "real", "virtual", "worst"]
                assert 0 < figures["worst"] <= figures["all"] < top
            assert point["encode_seconds"] > 0
            assert point["decode_seconds"] > 0
    ours = document["curves"][0]["points"]
    assert [point["qp"] for point in ours] == [24, 30, 36, 42]
    assert [point["settings"]["qp"] for point in ours] == [24, 30, 36, 42]
    assert all(1 <= point["settings"]["disparity_qp"] <= 51 for point in ours)
    for delta in document["bd_rate"].values():
        low, high = delta["overlap_db"]
        assert low < high
        assert isinstance(delta["all"], float)
        assert (delta["virtual"] is None) == (delta["virtual_overlap_db"] is None)
    assert document["pictures"]
    for curve in document["curves"]:
        (versions,) = curve["versions"]
        assert {
            "mvcodec",
            "python",
            "av",
            "numpy",
            "numba",
            "opencv-python-headless",
            "ffmpeg",
        } <= versions.keys()
        assert versions.items() <= document["versions"].items()


def test_bits_of_our_own_curve_are_those_of_the_file_with_its_container(measured: Path) -> None:
    files = {path.stat().st_size * 8: path for path in (measured / "points").glob("*.mcap")}
    points = report(measured)["curves"][0]["points"]
    assert sorted(files) == sorted(point["bits"] for point in points)
    for point in points:
        bits = read_info(files[point["bits"]]).bits
        assert point["bits_split"] == {
            "texture": bits.texture,
            "disparity": bits.disparity,
            "rest": bits.other,
            "enhancement": 0,
        }


def test_our_own_curve_is_what_encode_decode_and_compare_give(
    array: Path, measured: Path, tmp_path: Path
) -> None:
    options = ("--qp", "30", "--preset", "ultrafast", "--disparity-range", "0,8")
    succeeds("encode", array, tmp_path / "x.mcap", *options)
    succeeds("decode", tmp_path / "x.mcap", tmp_path / "out", "--synthesizer", "linear")
    compared = json.loads(succeeds("compare", array, tmp_path / "out", "--json"))
    point = report(measured)["curves"][0]["points"][1]
    for metric in ("psnr_y", "ssim"):
        assert point[metric] == pytest.approx(compared[metric])


def test_simulcast_of_an_array_whose_cameras_are_all_real_costs_what_our_pictures_cost(
    tmp_path: Path,
) -> None:
    folder = write_array(tmp_path / "all", 2, 2, frames=3, name="small")
    arguments = ("--frames", "0:2", "--qp", "30", "--anchors", "pvs", "--anchor-codecs", "h264")
    printed = succeeds("evaluate", folder, "--output", tmp_path / "report", *arguments, *FAST)
    document = report(tmp_path / "report")
    assert (document["input"], document["frames"]) == ("small", 2)
    assert [curve["name"] for curve in document["curves"]] == ["mvcodec", "simulcast", "pvs", "pvs-rows"]
    ours, simulcast = (curve["points"][0] for curve in document["curves"][:2])
    assert simulcast["bits"] == ours["bits_split"]["texture"]
    assert simulcast["psnr_y"] == ours["psnr_y"]
    assert ours["psnr_y"]["virtual"] is None
    assert document["bd_rate"]["pvs"]["virtual"] is None
    assert " - %" in printed


def test_the_page_needs_nothing_from_elsewhere_and_shows_everything(measured: Path) -> None:
    page = (measured / "report.html").read_text()
    assert not re.findall(r"""(?:src|href)=["'](?!data:)""", page)
    assert "<script" not in page
    assert page.count('src="data:image/') == 5
    for curve in report(measured)["curves"]:
        assert curve["label"] in page
    assert read_picture(measured / "rd.png").shape[1] > 1000
    assert (measured / "rd.svg").read_text().startswith("<?xml")


def test_table_of_views_has_every_view_of_every_point(measured: Path) -> None:
    with (measured / "views.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 13 * 4 * 6
    ours = [row for row in rows if row["curve"] == "mvcodec" and row["qp"] == "24"]
    assert [(int(row["row"]), int(row["col"])) for row in ours] == [
        (r, c) for r in range(2) for c in range(3)
    ]
    mean = sum(float(row["psnr_y_db"]) for row in ours) / 6
    assert mean == pytest.approx(report(measured)["curves"][0]["points"][0]["psnr_y"]["all"], abs=1e-3)
    assert [row["kind"] for row in ours].count("real") == 4


def test_points_are_measured_once(array: Path, measured: Path) -> None:
    before, first = point_times(measured), report(measured)
    assert len(before) == 13 * 4
    succeeds("evaluate", array, "--output", measured, "--qp", "24,30,36,42", *FAST)
    assert point_times(measured) == before
    assert report(measured) == first


def test_other_settings_are_measured_anew(array: Path, measured: Path, tmp_path: Path) -> None:
    shutil.copytree(measured, tmp_path / "copy")
    before = point_times(tmp_path / "copy")
    arguments = ("--qp", "24,30,36,42", *FAST, "--disparity-qp", "45")
    succeeds("evaluate", array, "--output", tmp_path / "copy", *arguments)
    assert len(point_times(tmp_path / "copy").keys() - before.keys()) == 4, "mvcodec's own points alone"
    maps = [
        [point["bits_split"]["disparity"] for point in report(folder)["curves"][0]["points"]]
        for folder in (measured, tmp_path / "copy")
    ]
    assert maps[1][0] < maps[0][0]


def change_points(folder: Path, curve: str, codec: str, decibel: float, rate: float, qp: int = 0) -> None:
    """Shift an anchor's measured points, or the one of a QP: by so many dB, and by a factor of the rate."""
    for path in (folder / "points").glob("*.json"):
        document = json.loads(path.read_text())
        depends_on, point = document["depends_on"], document["point"]
        named = (depends_on["curve"], depends_on["options"]["codec"]) == (curve, codec)
        if named and qp in (0, point["qp"]):
            point["kbps"] *= rate
            for view in point["quality"]["views"]:
                view["psnr_y"] += decibel
            path.write_text(json.dumps(document))


def test_weak_figures_are_told_in_every_place(array: Path, measured: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(measured, tmp_path / "copy"))
    change_points(folder, "simulcast", "hevc", 5, 1)
    change_points(folder, "simulcast-b", "hevc", 0, 0.001)
    change_points(folder, "pvs", "h264", 0, 1000, qp=36)
    change_points(folder, "pvs", "hevc", -50, 1)
    done = mvcodec("evaluate", array, "--output", folder, "--qp", "24,30,36,42", *FAST)
    assert done.returncode == 0, done.stderr
    document, page = report(folder), (folder / "report.html").read_text()
    dent = "PVS, all views, H.264: not monotonic: 1 of 4 points are left out of BD figures"
    assert dent in document["warnings"]
    told = {dent}
    for name, label, reason in (
        ("simulcast-hevc", "simulcast, no B-frames, HEVC", "all views: short overlap: "),
        ("simulcast-b-hevc", "simulcast, B-frames, HEVC", "all views: no rate in common: no BD-PSNR"),
        ("pvs-hevc", "PVS, all views, HEVC", "all views: no quality in common: no BD-rate"),
    ):
        warnings = document["bd_rate"][name]["warnings"]
        assert any(text.startswith(reason) for text in warnings), warnings
        told.add(f"BD figures against {label}: {'; '.join(warnings)}")
    assert "simulcast, no B-frames, AV1; simulcast, B-frames, AV1" in page, "points of one set of versions"
    for text in told:
        assert f"mvcodec: warning: {text}" in done.stderr.splitlines()
        assert f"<li>{text}</li>" in page


def test_the_page_says_where_an_anchor_is_ahead(array: Path, measured: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(measured, tmp_path / "copy"))
    change_points(folder, "simulcast", "hevc", 50, 1)
    change_points(folder, "simulcast-b", "hevc", 30, 0.001)
    change_points(folder, "pvs", "hevc", -50, 1)
    change_points(folder, "pvs-rows", "hevc", -50, 20)
    change_points(folder, "pvs-rows", "hevc", 100, 1, qp=24)
    change_points(folder, "pvs-rows", "hevc", 100, 1, qp=30)
    succeeds("evaluate", array, "--output", folder, "--qp", "24,30,36,42", *FAST)
    page, deltas = (folder / "report.html").read_text(), report(folder)["bd_rate"]
    lowest = report(folder)["curves"][0]["points"][-1]["kbps"]
    for name, label, words in (
        ("simulcast-hevc", "simulcast, no B-frames, HEVC", "ahead everywhere, from "),
        ("simulcast-b-hevc", "simulcast, B-frames, HEVC", f"ahead everywhere, from {lowest:.0f} kbit/s, "),
        ("pvs-hevc", "PVS, all views, HEVC", "not in this range"),
        ("pvs-rows-hevc", "PVS, each row, HEVC", "{kbps:.0f} kbit/s, {psnr_y:.2f} dB"),
    ):
        found = deltas[name]["overtaken"]
        assert (found is None) == (words == "not in this range")
        assert bool(deltas[name]["anchor_ahead_kbps"]) == (found is not None)
        cell = words.format(**found or {})
        assert re.search(rf"<td>{label}</td>(<td>[^<]*</td>){{4}}<td>{re.escape(cell)}", page), (label, cell)


@pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)
def test_the_page_shows_all_columns_on_a_screen_of_1200_px(tab: Page, measured: Path) -> None:
    tab.set_viewport_size({"width": 1200, "height": 800})
    tab.goto((measured / "report.html").as_uri())
    hidden = "[...document.querySelectorAll('.scroll')].map((table) => table.scrollWidth - table.clientWidth)"
    assert tab.evaluate(hidden) == [0, 0]
    assert tab.evaluate("document.documentElement.scrollWidth") <= 1200


def plot(*arguments: str | Path) -> tuple[int, str]:
    """The tool's exit code, and what it says on standard error."""
    with redirect_stderr(io.StringIO()) as said:
        code = rd_plot.main(list(map(str, arguments)))
    return code, said.getvalue()


def test_one_figure_of_several_reports(measured: Path, tmp_path: Path) -> None:
    other = tmp_path / "second" / "report.json"
    other.parent.mkdir()
    document = report(measured)
    other.write_text(json.dumps({**document, "input": "elsewhere"}))
    first = measured / "report.json"
    sizes = []
    for number, reports in enumerate(([first], [first, other])):
        assert plot(*reports, "-o", tmp_path / f"{number}.png") == (0, "")
        sizes.append(read_picture(tmp_path / f"{number}.png").shape)
    assert sizes[1][0] > 1.5 * sizes[0][0], "an input of its own has panels of its own"
    shutil.copytree(measured, tmp_path / "third")
    arguments = (first, tmp_path / "third" / "report.json", "--anchors", "pvs-hevc", "-o")
    assert plot(*arguments, tmp_path / "x.svg") == (0, "")
    subprocess.run(
        [sys.executable, ROOT / "tools" / "rd_plot.py", *arguments, tmp_path / "y.svg"], check=True
    )
    assert (tmp_path / "x.svg").read_bytes() == (tmp_path / "y.svg").read_bytes()


def test_plot_refuses_what_it_cannot_read_or_write(measured: Path, tmp_path: Path) -> None:
    (tmp_path / "x.json").write_text("[]")
    first = measured / "report.json"
    for arguments, code, message in (
        ((tmp_path / "none.json", "-o", tmp_path / "x.svg"), 1, "expected a report.json"),
        ((tmp_path / "x.json", "-o", tmp_path / "x.svg"), 1, "JSON of another kind"),
        ((first, "-o", tmp_path / "x.txt"), 2, "expected a name that ends in .svg"),
        ((first, "-o", tmp_path / "no" / "x.svg"), 1, "cannot be written"),
        (
            (first, "-o", tmp_path / "x.svg", "--anchors", "none"),
            2,
            "--anchors: found none, expected some of",
        ),
    ):
        found, said = plot(*arguments)
        assert (found, len(said.splitlines())) == (code, 1), said
        assert message in said
