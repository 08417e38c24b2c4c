"""Settings dataclasses: one place for type, range and help; what is checked and read comes from there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

import pytest

from mvcodec.encoding.config import EncoderConfig
from mvcodec.errors import SettingError
from mvcodec.settings import check_settings, setting, settings_of
from mvcodec.video.codec import RateControl


class Side(StrEnum):
    LEFT = "l"
    RIGHT = "r"


@dataclass(frozen=True, slots=True)
class Sample:
    window: int = setting(5, "side of the window", choices=range(1, 10, 2), expected="an odd number, 1..9")
    share: float = setting(0.5, "of the left picture", low=0, high=1)
    fill: bool = setting(True, "fill holes")
    side: Side = setting(Side.LEFT, "which one")
    span: float | None = setting(None, "of something, measured where none is given", low=0.1)
    silent: int = 3

    def __post_init__(self) -> None:
        check_settings(self, "Sample.")


def test_the_field_says_everything() -> None:
    known = settings_of(Sample)
    assert list(known) == ["window", "share", "fill", "side", "span"]
    assert [known[name].allowed for name in known] == [
        "an odd number, 1..9",
        "a number, 0..1",
        "yes or no",
        "l or r",
        "a number of at least 0.1",
    ]
    assert (known["span"].optional, known["share"].optional) == (True, False)
    assert (known["window"].default, known["side"].type, known["fill"].help) == (5, Side, "fill holes")


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("window", 4),
        ("window", True),
        ("share", 1.5),
        ("share", float("nan")),
        ("share", None),
        ("share", "x"),
        ("fill", 1),
        ("side", "up"),
        ("span", 0.0),
        ("window", 2.5),
        ("window", 3.0),
    ],
)
def test_values_outside_are_refused_by_name(field: str, value: object) -> None:
    with pytest.raises(SettingError, match=rf"^Sample\.{field}: found .*, expected "):
        replace(Sample(), **{field: value})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("field", "text", "value"),
    [
        ("window", "7", 7),
        ("share", "0.25", 0.25),
        ("share", "1", 1.0),
        ("fill", "no", False),
        ("fill", "on", True),
        ("side", "r", Side.RIGHT),
        ("span", "none", None),
        ("span", "2", 2.0),
    ],
)
def test_values_are_read_from_text(field: str, text: str, value: object) -> None:
    found = settings_of(Sample)[field].read(text)
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize(
    ("field", "text"),
    [("window", "7.5"), ("share", "half"), ("fill", "maybe"), ("share", "none"), ("side", "")],
)
def test_text_that_stands_for_no_value_is_refused(field: str, text: str) -> None:
    with pytest.raises(SettingError, match=rf"^{field}: found .*, expected "):
        settings_of(Sample)[field].read(text)


def test_rate_control_is_one_field_with_three_short_forms() -> None:
    assert EncoderConfig().rate == RateControl(qp=27)
    assert EncoderConfig(qp=22).rate == RateControl(qp=22)
    assert EncoderConfig(crf=23).rate == EncoderConfig(rate=RateControl(crf=23)).rate == RateControl(crf=23)
    assert EncoderConfig(bitrate_kbps=800).rate == RateControl(bitrate_kbps=800)


def test_a_changed_config_keeps_its_rate_or_takes_the_new_one() -> None:
    config = EncoderConfig(crf=23)
    assert replace(config, gop=5).rate == RateControl(crf=23)
    assert replace(config, qp=30).rate == RateControl(qp=30)
    assert replace(config, rate=RateControl(bitrate_kbps=9)).rate == RateControl(bitrate_kbps=9)


def test_two_rates_are_refused() -> None:
    with pytest.raises(SettingError, match="qp, crf, bitrate_kbps: found qp and crf, expected exactly one"):
        EncoderConfig(qp=27, crf=23)


@dataclass(frozen=True, slots=True)
class Pair:
    grid: tuple[int, int] = setting((2, 2), "(rows, cols)", low=1, high=9, expected="RxC, each 1..9")
    flaws: tuple[str, ...] = setting(("gain",), "what is wrong", choices=("gain", "delay"))

    def __post_init__(self) -> None:
        check_settings(self)


def test_bounds_and_choices_of_a_tuple_are_each_parts() -> None:
    assert Pair((9, 1), ()).flaws == ()
    assert Pair(flaws=("delay", "gain")).grid == (2, 2)


@pytest.mark.parametrize(
    ("field", "value", "found"),
    [
        ("grid", (0, 2), "0x2"),
        ("grid", (2, 10), "2x10"),
        ("grid", (2, 2, 2), "2x2x2"),
        ("grid", (2.0, 2), "2.0,2"),
        ("grid", "2x2", "2x2"),
        ("flaws", ("gain", "dust"), "gain,dust"),
        ("flaws", "gain", "gain"),
    ],
)
def test_tuples_outside_are_refused_as_they_are_written(field: str, value: object, found: str) -> None:
    with pytest.raises(SettingError, match=rf"^{field}: found {found}, expected "):
        replace(Pair(), **{field: value})  # type: ignore[arg-type]
