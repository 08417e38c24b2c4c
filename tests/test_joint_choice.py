"""`--target-psnr` with `--enhance auto`: base and layer chosen together."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from command_line import fails, succeeds
from small_arrays import write_array

from mvcodec.capture import open_input
from mvcodec.container import read_info
from mvcodec.encoding.config import EncoderConfig
from mvcodec.encoding.encoder import Encoder
from mvcodec.errors import SettingError
from mvcodec.evaluation import joint_choice
from mvcodec.evaluation.joint_choice import LEAST_GAIN, choose_together
from mvcodec.evaluation.remembered import MapSpool
from mvcodec.evaluation.trial_coding import UNIT_BYTES, Trial, Trials, checked, probed
from mvcodec.synthesis.synthesizers import make_synthesizer

CONFIG = EncoderConfig(matcher="sgbm", preset="ultrafast", disparity_range_px=(0, 12), enhance="auto")
LAYERED = make_synthesizer("layered")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_array(tmp_path_factory.mktemp("array"), 3, 3, 4)


def test_parts_of_an_input_that_are_coded() -> None:
    assert probed(range(5, 6)) == [range(5, 6)]
    assert probed(range(0, 9)) == [range(3, 5)]
    assert checked(range(2, 14)) == [range(2, 14)]
    assert checked(range(100)) == [range(3), range(32, 35), range(64, 67), range(97, 100)]


def test_a_trial_weighs_keyframes_as_the_file_has_them(folder: Path, tmp_path: Path) -> None:
    source = open_input([folder])
    config = replace(CONFIG, qp=30, enhance=33.5)
    with MapSpool(tmp_path) as spool:
        few = Trials(source, range(4), [range(2)], LAYERED, spool)(config)
        single = Trials(source, range(4), [range(1)], LAYERED, spool)(config)
    with Encoder(source.array, config) as encoder:
        sets = [encoder.push(frames) for frames in source.frame_sets(slice(2), encoder.views)]
    key, other = (8 * sum(len(packet.data) + UNIT_BYTES for packet in packets) for packets in sets)
    assert few.bits == pytest.approx(key / 4 + other * 3 / 4)
    assert single.bits == pytest.approx(key)
    assert single.base_bits < single.bits


def test_a_base_is_coded_once_and_its_layers_are_those_of_an_encoder(folder: Path, tmp_path: Path) -> None:
    source = open_input([folder])
    with MapSpool(tmp_path) as spool:
        again = Trials(source, range(4), [range(2)], LAYERED, spool)
        again(replace(CONFIG, qp=30, enhance=20))
        second = again(replace(CONFIG, qp=30, enhance=33.5))
        afresh = Trials(source, range(4), [range(2)], LAYERED, spool)(second.config)
    assert second == afresh


def test_what_is_chosen_reaches_the_quality_with_fewer_bits_than_the_model(
    folder: Path, tmp_path: Path
) -> None:
    source = open_input([folder])
    tried: list[None] = []
    found = choose_together(source, range(4), CONFIG, 33.0, LAYERED, lambda: tried.append(None))
    assert found.psnr_y >= 33.0
    assert found.codings == len(tried) <= 20
    with MapSpool(tmp_path) as spool:
        trials = Trials(source, range(4), checked(range(4)), LAYERED, spool)
        bits = [
            trial.bits
            for trial in (trials(replace(CONFIG, qp=qp)) for qp in range(16, 34, 2))
            if trial.psnr_y >= 33.0
        ]
    assert found.bits <= min(bits)


class Made:
    """Trials of a codec that is a formula."""

    def __init__(
        self,
        bits: Callable[[int, float], float],
        psnr_y: Callable[[int, float], float],
        share: Callable[[EncoderConfig], float] = lambda _: 1.0,
    ) -> None:
        self.bits, self.psnr_y, self.share, self.count = bits, psnr_y, share, 0

    def __call__(self, config: EncoderConfig) -> Trial:
        self.count += 1
        qp, layer = config.rate.qp, config.enhance
        assert qp is not None
        assert not isinstance(layer, str)
        of_layer = math.inf if layer is None else layer
        share = self.share(config)
        base, bits = share * self.bits(qp, math.inf), share * self.bits(qp, of_layer)
        return Trial(config, bits, base, self.psnr_y(qp, of_layer))


@pytest.mark.parametrize(("cheapest", "target_db"), [(25, 36.0), (20, 37.0), (31, 34.0)])
def test_the_base_with_the_fewest_bits_is_found(folder: Path, cheapest: int, target_db: float) -> None:
    def psnr_y(qp: int, layer: float) -> float:
        return 43.5 - 0.15 * qp - (0.3 * min(layer, 51) - 5)

    def bits(qp: int, layer: float) -> float:
        if layer == math.inf:
            return 1e5
        return 1e6 * math.exp(0.004 * (qp - cheapest) ** 2 + 0.5 * (psnr_y(qp, layer) - target_db))

    made = Made(bits, psnr_y)
    array = open_input([folder])
    best = joint_choice._Search(array, CONFIG, target_db, made, made).best()  # type: ignore[arg-type]
    assert best.config.rate.qp is not None
    assert abs(best.config.rate.qp - cheapest) <= 1
    assert target_db <= best.psnr_y <= target_db + joint_choice.CLOSE
    assert math.log(best.bits / 1e6) <= 0.004 + LEAST_GAIN + 0.5 * joint_choice.CLOSE
    assert made.count <= 26


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"prediction": "synthesis"}, ("nearest", True)),
        ({"prediction": "synthesis", "second_reference": "none"}, ("none", True)),
        ({"prediction": "synthesis", "disparity_qp": 27}, ("nearest", False)),
        ({}, (None, False)),
    ],
)
def test_what_is_left_open_is_chosen_where_it_pays(
    folder: Path, given: dict[str, Any], expected: tuple[str | None, bool]
) -> None:
    """Beside cameras that play alone nothing is tried that older readers don't know."""

    def share(config: EncoderConfig) -> float:
        coarse = config.disparity_qp is not None and config.disparity_qp != given.get("disparity_qp")
        return (0.9 if config.second_reference == "nearest" else 1) * (0.9 if coarse else 1)

    def psnr_y(qp: int, layer: float) -> float:
        return 43.5 - 0.15 * qp - (0.3 * min(layer, 51) - 5)

    def bits(qp: int, layer: float) -> float:
        if layer == math.inf:
            return 1e5
        return 1e6 * math.exp(0.004 * (qp - 25) ** 2 + 0.5 * (psnr_y(qp, layer) - 36.0))

    made, config = Made(bits, psnr_y, share), replace(CONFIG, **given)
    array = open_input([folder])
    best = joint_choice._Search(array, config, 36.0, made, made).best().config  # type: ignore[arg-type]
    coarse = best.disparity_qp is not None and best.disparity_qp != given.get("disparity_qp")
    assert (best.second_reference, coarse) == expected


def test_the_layer_gets_finer_until_the_quality_is_seen_to_be_reached(folder: Path) -> None:
    """Quantizers are whole numbers: a small change of the QP may change nothing."""

    def psnr_y(qp: int, layer: float) -> float:
        return 43.5 - 0.15 * qp - (0.15 * round(2 * min(layer, 51)) - 5)

    made = Made(lambda qp, layer: 1e6 * math.exp(0.5 * psnr_y(qp, layer) + 0.004 * (qp - 25) ** 2), psnr_y)
    array = open_input([folder])
    target = psnr_y(25, 29) + 0.005
    best = joint_choice._Search(array, CONFIG, target, made, made).best()  # type: ignore[arg-type]
    assert best.psnr_y >= target


def test_no_layer_is_chosen_where_none_pays(folder: Path) -> None:
    made = Made(
        lambda qp, layer: 1e6 * 2 ** (-qp / 6) * (1 if layer == math.inf else 3), lambda qp, _: 45 - 0.4 * qp
    )
    array = open_input([folder])
    best = joint_choice._Search(array, CONFIG, 35.0, made, made).best()  # type: ignore[arg-type]
    assert (best.config.rate.qp, best.config.enhance) == (25, None)


def test_a_quality_beyond_the_finest_layer_is_told(folder: Path) -> None:
    with pytest.raises(SettingError, match=r"target_psnr: found 90 dB, expected at most about .* dB"):
        choose_together(open_input([folder]), range(2), CONFIG, 90.0, LAYERED)


def test_encode_says_what_was_chosen(folder: Path, tmp_path: Path) -> None:
    options = ["--enhance", "auto", "--target-psnr", "33", "--preset", "ultrafast", "--matcher", "sgbm"]
    output = succeeds("encode", folder, tmp_path / "x.mcap", *options, "--json")
    document = json.loads(output)
    chosen = document["chosen"]
    assert chosen["psnr_y"] >= 33
    assert chosen["codings"] > 1
    assert document["rate"] == {"qp": chosen["qp"]}
    assert document["disparity_scale"] == chosen["disparity_scale"]
    layer = read_info(tmp_path / "x.mcap").layer
    assert (None if layer is None else layer.settings["enhance"]) == chosen["enhance"]


def test_a_fraction_of_a_qp_is_a_layer_of_its_own(folder: Path, tmp_path: Path) -> None:
    sizes = []
    for qp in ("24", "24.5", "25"):
        options = f"--qp 30 --enhance {qp} --preset ultrafast --matcher sgbm --overwrite --frames :1".split()
        succeeds("encode", folder, tmp_path / "x.mcap", *options)
        sizes.append(read_info(tmp_path / "x.mcap").bits.enhancement)
    assert sizes[0] > sizes[1] > sizes[2]
    beyond = fails(2, "encode", folder, tmp_path / "y.mcap", "--enhance", "51.5")
    assert "--enhance: found 51.5, expected 1..51, +QPS" in beyond


def test_within_a_bit_rate_the_layer_follows_the_pictures(folder: Path, tmp_path: Path) -> None:
    options = ["--enhance", "auto", "--preset", "ultrafast", "--matcher", "sgbm", "--json"]
    found = {}
    for kbps in ("100", "4000"):
        output = succeeds("encode", folder, tmp_path / "x.mcap", "--bitrate", kbps, "-y", *options)
        document = json.loads(output)
        found[kbps] = document["chosen"]["enhance"]
        layer = read_info(tmp_path / "x.mcap").layer
        assert (None if layer is None else layer.settings["enhance"]) == found[kbps]
    assert found["100"] is None  # where bits are few no layer pays
    assert float(found["4000"]) > -10


def test_a_layer_is_so_many_qps_coarser_than_the_pictures() -> None:
    assert EncoderConfig(qp=30, enhance="+2.5").layer_quality(5, 4) == 32.5
    assert EncoderConfig(qp=30, enhance="-2").layer_quality(5, 4) == 28
    assert EncoderConfig(qp=50, enhance="+9").layer_quality(5, 4) == 51
    assert EncoderConfig(bitrate_kbps=100, enhance="+2").shared_kbps == 100
    with pytest.raises(SettingError, match=r"enhance: found \+x, expected a QP, \+QPS or auto"):
        EncoderConfig(enhance="+x")
    with pytest.raises(SettingError, match=r"enhance: found \+99, expected a QP, auto, or -24..\+24"):
        EncoderConfig(enhance="+99")
