"""Which cameras are real: every form of `--real`, and the legal choices where it is wrong."""

from __future__ import annotations

import pytest

from mvcodec.array import Calibration, CameraArray
from mvcodec.capture.selection import RealAxes, select_real
from mvcodec.errors import SettingError


@pytest.mark.parametrize(
    ("text", "grid", "expected"),
    [
        ("corners", (5, 5), ((0, 4), (0, 4))),
        ("corners", (1, 7), ((0,), (0, 6))),
        ("corners", (4, 1), ((0, 3), (0,))),
        ("corners", (1, 1), ((0,), (0,))),
        ("corners", (2, 2), ((0, 1), (0, 1))),
        ("all", (2, 3), ((0, 1), (0, 1, 2))),
        ("all", (1, 2), ((0,), (0, 1))),
        ("every:4", (17, 17), ((0, 4, 8, 12, 16), (0, 4, 8, 12, 16))),
        ("every:2", (5, 9), ((0, 2, 4), (0, 2, 4, 6, 8))),
        ("every:3", (1, 7), ((0,), (0, 3, 6))),
        ("every:1", (3, 4), ((0, 1, 2), (0, 1, 2, 3))),
        ("0,4x0,4", (5, 5), ((0, 4), (0, 4))),
        ("0,2,4x0,4", (5, 5), ((0, 2, 4), (0, 4))),
        ("0x0,3,6", (1, 7), ((0,), (0, 3, 6))),
    ],
)
def test_forms(text: str, grid: tuple[int, int], expected: RealAxes) -> None:
    assert select_real(text, *grid) == expected


@pytest.mark.parametrize(
    "text",
    [
        *("", "edges", "every:3", "every:0", "every:", "every:x", "every:-2", "every:8"),
        *("0,5x0,4", "0,1,4x0,4", "0x0,4", "4,0x0,4", "0,4x1,4", "0,0,4x0,4"),
        *("0,4", "0,4x0,4x0", "0,4x0,,4", "0,4 x 0,4", "0,²x0,4"),
    ],
)
def test_other_texts_are_refused_with_the_choices(text: str) -> None:
    with pytest.raises(SettingError) as caught:
        select_real(text, 5, 5)
    assert str(caught.value) == (
        f"real: found {text or 'nothing'}, expected corners, all, every:K with K one of 1, 2, 4, "
        "or rows (0,4 or 0,2,4 or 0,1,2,3,4) x cols (0,4 or 0,2,4 or 0,1,2,3,4) for this 5x5 grid"
    )


def test_wide_grids_keep_the_line_short() -> None:
    with pytest.raises(SettingError) as caught:
        select_real("every:5", 17, 25)
    assert "every:K with K one of 1, 2, 4, 8," in str(caught.value)
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize("rows", [1, 2, 3, 5, 7])
@pytest.mark.parametrize("cols", [1, 2, 4, 9])
def test_whatever_is_accepted_makes_an_array(rows: int, cols: int) -> None:
    texts = ["corners", "all", *(f"every:{step}" for step in range(1, 10))]
    accepted = 0
    for text in texts:
        try:
            real_rows, real_cols = select_real(text, rows, cols)
        except SettingError:
            continue
        accepted += 1
        array = CameraArray(rows, cols, 8, 8, 1.0, real_rows, real_cols, Calibration.nominal(8, 8))
        assert {(0, 0), (rows - 1, cols - 1)} <= set(array.real)
    assert accepted >= 3
