"""What figures show: labels with units, the legend, and which curves are drawn in which panel."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from mvcodec.evaluation.figures import heat_figure, saved, split_figure, ssim_figure
from mvcodec.evaluation.rate_figure import rd_figure

KINDS = ("all", "real", "virtual", "worst")


def curve(name: str, label: str, anchor: str | None, shift_db: float, codec: str = "h264") -> dict[str, Any]:
    points = [
        {
            "qp": qp,
            "bits": 10_000 * kbit,
            "kbps": float(kbit),
            "psnr_y": dict.fromkeys(KINDS, 40 - qp / 5 + shift_db),
            "ssim": dict.fromkeys(KINDS, 0.99 - qp / 500),
            "bits_split": {"texture": 8000 * kbit, "disparity": 1500 * kbit, "rest": 500 * kbit},
        }
        for qp, kbit in ((27, 800), (37, 100))
    ]
    return {"name": name, "label": label, "anchor": anchor, "codec": codec, "points": points}


def report(**facts: Any) -> dict[str, Any]:
    return {
        "input": "hall",
        "grid": [2, 3],
        "size": [640, 360],
        "fps": 10.0,
        "real": [[0, 0], [1, 2]],
        "frames": 4,
        "first_frame": 2,
        "pictures": "abc",
        "curves": [
            curve("mvcodec", "mvcodec, H.264", None, 1.0),
            curve("simulcast", "simulcast, H.264", "simulcast", 0.0),
            curve("pvs-hevc", "PVS, HEVC", "pvs", 0.5, "hevc"),
        ],
        **facts,
    }


def legend(figure: Figure) -> list[str]:
    (found,) = figure.legends
    return [text.get_text() for text in found.get_texts()]


def drawn(figure: Figure) -> list[list[str]]:
    """The labels of each panel's curves."""
    return [sorted(str(line.get_label()) for line in axes.lines) for axes in figure.axes]


def boxes(axes: Axes) -> list[Rectangle]:
    return [patch for patch in axes.patches if isinstance(patch, Rectangle)]


def titles(figure: Figure) -> list[str]:
    return [axes.get_title(loc="left") for axes in figure.axes]


@pytest.mark.parametrize(("metric", "label"), [("psnr_y", "Y-PSNR (dB)"), ("ssim", "SSIM (luma)")])
def test_one_report_has_both_classes_of_views_with_units_and_every_curve(metric: str, label: str) -> None:
    document = report()
    figure = rd_figure([document], metric)
    assert titles(figure) == ["All views", "Virtual views"]
    labels = [each["label"] for each in document["curves"]]
    assert legend(figure)[0] == "mvcodec, H.264"
    assert sorted(legend(figure)) == sorted(labels)
    assert drawn(figure) == [sorted(labels)] * 2
    for axes in figure.axes:
        assert axes.get_ylabel() == label
        assert axes.get_xlabel() == "Rate of the whole array (kbit/s)"
        assert axes.get_xscale() == "log"
        for line in axes.lines:
            (shown,) = [each for each in document["curves"] if each["label"] == line.get_label()]
            expected = [(point["kbps"], point[metric]["all"]) for point in shown["points"]]
            np.testing.assert_array_equal(line.get_xydata(), expected)
    looks = {(line.get_color(), line.get_marker(), line.get_linestyle()) for line in figure.axes[0].lines}
    assert len(looks) == 3


def test_a_class_without_views_is_said_to_be_empty() -> None:
    document = report()
    for each in document["curves"]:
        for point in each["points"]:
            point["psnr_y"]["virtual"] = None
    left, right = rd_figure([document]).axes
    assert len(left.lines) == 3
    assert not right.lines
    assert [text.get_text() for text in right.texts] == ["no such view"]


def test_anchors_are_chosen_by_name() -> None:
    assert drawn(rd_figure([report()], only=["pvs-hevc"])) == [["PVS, HEVC", "mvcodec, H.264"]] * 2


def test_equal_anchors_of_one_input_are_drawn_once() -> None:
    figure = rd_figure([report(), report(real=[[0, 0]])], names=["a", "b"])
    ours = ["mvcodec, H.264 (a)", "mvcodec, H.264 (b)"]
    assert drawn(figure) == [["PVS, HEVC", *ours, "simulcast, H.264"]] * 2
    first, second = (line for line in figure.axes[0].lines if line.get_label() in ours)
    assert first.get_color() != second.get_color()


def test_anchors_with_other_points_are_drawn_beside_each_other_and_told_apart() -> None:
    other = deepcopy(report())
    other["curves"][1]["points"][0]["kbps"] = 500.0
    del other["curves"][1]["points"][1]
    figure = rd_figure([report(), other, report()], names=["a", "b", "c"])
    names = [f"mvcodec, H.264 ({name})" for name in "abc"]
    assert drawn(figure)[0] == ["PVS, HEVC", *names, "simulcast, H.264 (a, c)", "simulcast, H.264 (b)"]
    assert set(drawn(figure)[0]) == set(legend(figure))
    pair = [line for line in figure.axes[0].lines if str(line.get_label()).startswith("simulcast")]
    assert pair[0].get_markerfacecolor() != pair[1].get_markerfacecolor()
    assert [len(np.asarray(line.get_xydata())) for line in pair] == [2, 1]


@pytest.mark.parametrize(
    ("facts", "told"),
    [
        ({"size": [320, 180]}, ("640 x 360 px, frames 2 to 5", "320 x 180 px, frames 2 to 5")),
        ({"first_frame": 0}, ("640 x 360 px, frames 2 to 5", "640 x 360 px, frames 0 to 3")),
        ({"frames": 1}, ("640 x 360 px, frames 2 to 5", "640 x 360 px, frame 2")),
        ({"pictures": "x"}, ("640 x 360 px, frames 2 to 5 (a)", "640 x 360 px, frames 2 to 5 (b)")),
    ],
)
def test_other_inputs_of_one_name_have_panels_and_titles_of_their_own(
    facts: dict[str, Any], told: tuple[str, str]
) -> None:
    figure = rd_figure([report(), report(**facts)], names=["a", "b"])
    assert len(figure.axes) == 4
    assert all(len(axes.lines) == 3 for axes in figure.axes)
    classes = ("all views", "virtual views")
    assert titles(figure) == [f"hall, 2 x 3: {what}\n{each}" for each in told for what in classes]


def test_reports_that_do_not_state_their_pictures_are_told_apart_by_their_path() -> None:
    old = report()
    del old["pictures"], old["size"]
    assert len(rd_figure([{**old, "path": "x"}, {**old, "path": "x"}], names=["a", "b"]).axes) == 2
    figure = rd_figure([{**old, "path": "x"}, {**old, "path": "y"}], names=["a", "b"])
    assert titles(figure)[::2] == [f"hall, 2 x 3: all views\nframes 2 to 5 ({name})" for name in "ab"]


def test_bars_show_kbit_of_a_frame_set_by_what_they_are_spent_on() -> None:
    (axes,) = split_figure(report()).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("QP", "kbit for each frame set")
    found = axes.get_legend()
    assert found is not None
    assert [text.get_text() for text in found.get_texts()] == ["pictures", "maps", "container, headers"]
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["27", "37"]
    heights = [patch.get_height() for patch in boxes(axes)]
    assert heights == pytest.approx([1600, 200, 300, 37.5, 100, 12.5])
    assert [text.get_text() for text in axes.texts] == ["maps 15%"] * 2


def test_heat_maps_frame_the_real_cameras_and_have_a_scale_in_db() -> None:
    values = np.arange(6.0).reshape(2, 3) + 30
    *panels, scale = heat_figure(report(), {27: values, 37: values - 5}).axes
    assert [panel.get_title(loc="left") for panel in panels] == ["QP 27", "QP 37"]
    assert scale.get_ylabel() == "Y-PSNR (dB)"
    assert (panels[0].get_xlabel(), panels[0].get_ylabel()) == ("column", "row")
    framed = [(round(patch.get_y() + 0.46), round(patch.get_x() + 0.46)) for patch in boxes(panels[0])]
    assert framed == [(0, 0), (1, 2)]
    assert [text.get_text() for text in panels[1].texts][:2] == ["25.0", "26.0"]


def test_ssim_maps_stand_beside_the_original() -> None:
    original = np.zeros((20, 30, 3), np.uint8)
    *panels, scale = ssim_figure(original, {27: np.full((10, 20), 0.5)}).axes
    assert [panel.get_title(loc="left") for panel in panels] == ["Original", "QP 27: SSIM 0.500"]
    assert scale.get_ylabel() == "SSIM (1 = alike)"


def test_pdf_has_fonts_that_publishers_take_and_is_the_same_each_time() -> None:
    pdf = saved(rd_figure([report()]), "pdf")
    assert b"/Type3" not in pdf
    assert b"/CIDFontType2" in pdf
    assert pdf == saved(rd_figure([report()]), "pdf")
