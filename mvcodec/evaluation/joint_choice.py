"""Base and enhancement layer chosen together: the fewest bits that reach a quality.

Near its target quality a coding is described by three slopes, which trials replace one after the other:
decibels for a QP of the layer, decibels for a QP of the base beside the same layer, and the logarithm of the
bits for a decibel that the layer buys. A trial that comes out near the target is brought there by these, so
that one or two trials for a base tell its price. Bases are gone through from one QP to the next while they
get cheaper.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from mvcodec.capture import ArraySource
from mvcodec.encoding.config import AUTO, EncoderConfig
from mvcodec.encoding.enhancer import enhanced_views
from mvcodec.encoding.stream_rate import HALVING
from mvcodec.errors import SettingError
from mvcodec.evaluation.remembered import MapSpool
from mvcodec.evaluation.target_quality import guessed_qp
from mvcodec.evaluation.trial_coding import Trial, Trials, checked, probed
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.video.codecs import find_codec

START = (24.0, 36.0)
"""A QP of libx264 and about the decibels that it reaches with its layer; a first guess."""

BOTH_DB, LAYER_DB, BASE_DB = -0.45, -0.3, -0.15
"""dB for one QP more, on libx264's scale: of base and layer, of the layer alone, of the base alone. First
guesses; trials replace the last two."""

PRICE = 0.55
"""Natural logarithm of the bits for a decibel that a finer layer brings; a first guess."""

ABOUT, NEAR, CLOSE = 1.0, 0.15, 0.015
"""dB from the target: of the first trial of which bases are compared, of trials that the slopes bring to the
target, and of the result, which is above it."""

LEAST_GAIN = 0.002
"""Share of the bits that a change of the base has to save."""

COARSER_MAPS = 5
"""QPs, on libx264's scale, by which maps are tried coarser than their model has them."""

FINER_STEP, LEAST_STEP, DIGITS = 0.1, 0.05, 2
"""QPs of the layer: least change to a finer one, the least between two, and the decimals that are kept."""

MOST_CHANGE = 2.5
"""A slope changes by no greater factor at a time."""

MOST_ROUNDS = 6


@dataclass(frozen=True, slots=True)
class Chosen:
    """The settings with the fewest bits that reach a quality.

    Attributes:
        config: whose enhancement layer is a QP, or None.
        psnr_y: what they reach, dB: mean luma PSNR over all views of the grid.
        bits: of a frame set.
        codings: how many trials that took.
    """

    config: EncoderConfig
    psnr_y: float
    bits: float
    codings: int


def choose_together(
    source: ArraySource,
    chosen: range,
    config: EncoderConfig,
    target_db: float,
    synthesizer: Synthesizer,
    on_coding: Callable[[], object] = lambda: None,
) -> Chosen:
    """Choose the pictures' QP, the layer's, whether there is one, and what is left open of how all is coded.

    Left open may be the maps' scale and QP, and the second reference of what is predicted.

    Args:
        chosen: frame numbers of the input, consecutive.
        config: its rate and its enhancement layer's QP are replaced.
        target_db: mean luma PSNR over all views of the grid, at least.
        on_coding: called after each trial.

    Raises:
        SettingError: nothing reaches it.
        InputError: the input lacks a view's originals.
    """
    with tempfile.TemporaryDirectory() as folder, MapSpool(Path(folder)) as spool:
        probes, checks = (
            Trials(source, chosen, parts, synthesizer, spool, on_coding)
            for parts in (probed(chosen), checked(chosen))
        )
        best = _Search(source, config, target_db, probes, checks).best()
        return Chosen(best.config, best.psnr_y, best.bits, probes.count + checks.count)


def choose_for_rate(
    source: ArraySource,
    chosen: range,
    config: EncoderConfig,
    synthesizer: Synthesizer,
    on_coding: Callable[[], object] = lambda: None,
) -> Chosen:
    """Choose the layer, or none, that is best beside pictures coded within a bit rate.

    Args:
        config: with a bit rate and an enhancement layer, whose QP is replaced by one that follows the
            pictures'.

    Returns:
        `config` with that layer, and what a trial of about that quality and rate was like.

    Raises, and the other arguments: as `choose_together`.
    """
    assert config.rate.bitrate_kbps is not None
    array = source.array
    per_set = 1000 * config.rate.bitrate_kbps / array.fps
    settled = replace(config, disparity_scale=config.scale_for(array))
    if config.disparity_cameras in (None, AUTO):
        settled = replace(settled, disparity_cameras=config.cameras_for(array))
    with tempfile.TemporaryDirectory() as folder, MapSpool(Path(folder)) as spool:
        trials = Trials(source, chosen, probed(chosen), synthesizer, spool, on_coding)
        search = _Search(source, settled, 0.0, trials, trials, maps_follow=True)
        best = search.cheapest_at(per_set)
        if best.config.enhance is None:
            found = replace(config, enhance=None, enhance_views=None, enhance_chain=None)
        else:
            offset = (_layer_qp(best) - _base_qp(best)) / find_codec(config.codec).qp_line[0]
            second = best.config.second_reference
            found = replace(config, enhance=f"{offset:+.1f}", second_reference=second)
        return Chosen(found, best.psnr_y, best.bits, trials.count)


class _Search:
    """One search; the slopes are on the codec's own scale of QPs.

    Args:
        maps_follow: the maps' QP will follow the pictures' as it changes, so that none is chosen.
    """

    def __init__(
        self,
        source: ArraySource,
        config: EncoderConfig,
        target_db: float,
        probes: Trials,
        checks: Trials,
        *,
        maps_follow: bool = False,
    ) -> None:
        self._maps_follow = maps_follow
        self._array, self._config, self._target = source.array, config, target_db
        self._try, self._check = probes, checks
        self._layer_views = len(enhanced_views(source.array, config.enhance_views))
        codec = find_codec(config.codec)
        self._codec, self._max_qp = codec, codec.max_qp
        self._layer, self._base = (slope / codec.qp_line[0] for slope in (LAYER_DB, BASE_DB))
        self._price = PRICE

    def best(self) -> Trial:
        """What costs least, and reaches the target."""
        best = self._cheapest(self._about())
        return self._finished_alone(best) if best.config.enhance is None else self._finished(best)

    def cheapest_at(self, bits: float) -> Trial:
        """What costs least at the quality that the model's layer has with about so many bits a frame set."""
        scale = self._codec.qp_line[0]
        qp = round(scale * START[0] + self._codec.qp_line[1])
        for _ in range(MOST_ROUNDS):
            trial = self._try(self._with_model(qp))
            step = round(HALVING * scale * math.log2(trial.bits / bits))
            before, qp = qp, min(max(qp + step, 1), self._max_qp)
            if qp == before:
                break
        self._target = trial.psnr_y
        return self._cheapest(trial)

    def _cheapest(self, trial: Trial) -> Trial:
        """The trial near the target that would cost least there, beginning with one."""
        best = start = self._brought(trial)
        for direction in (1, -1):
            moved = self._moved(best, direction)
            while moved is not None and self._pays(moved, best):
                best, moved = moved, self._moved(moved, direction)
            if best is not start:
                break
        for change in (self._small_maps, self._coarse_maps, self._nearest):
            config = change(best.config)
            if config is not None:
                changed = self._brought(self._try(config))
                best = changed if self._pays(changed, best) else best
        return self._alone(best) or best

    def _small_maps(self, config: EncoderConfig) -> EncoderConfig | None:
        """With maps of half size, if that was left open."""
        is_open = self._config.disparity_scale is None and config.scale_for(self._array) == 1
        return replace(config, disparity_scale=2) if is_open else None

    def _coarse_maps(self, config: EncoderConfig) -> EncoderConfig | None:
        """With coarser maps, if that was left open: theirs was chosen for what is rendered by them."""
        span = config.disparity_range_px
        is_open = config.disparity_qp is None and config.prediction != "none" and not self._maps_follow
        if not is_open or span is None:
            return None
        qp = config.rate_of_maps(self._array, span).qp
        assert qp is not None
        return replace(
            config, disparity_qp=min(qp + round(COARSER_MAPS * self._codec.qp_line[0]), self._max_qp)
        )

    def _nearest(self, config: EncoderConfig) -> EncoderConfig | None:
        """With second references, if that was left open and cameras are predicted.

        Beside cameras that play alone the layer stays one that older readers know.
        """
        is_open = self._config.second_reference is None and config.prediction != "none"
        return replace(config, second_reference="nearest") if is_open else None

    def _about(self) -> Trial:
        """A base with the layer that the model has for it, not far from the target."""
        slope, offset = self._codec.qp_line
        start = slope * (START[0] + (self._target - START[1]) / BOTH_DB) + offset
        return self._coarsest(lambda qp: self._try(self._with_model(qp)), start, about=True)[1]

    def _coarsest(
        self,
        coded: Callable[[int], Trial],
        start: float,
        most_bits: float = math.inf,
        *,
        about: bool = False,
    ) -> tuple[Trial | None, Trial]:
        """The trial of the largest QP that reaches the target with fewer bits, if one does; and the last one.

        Args:
            about: end with the first trial that is not far from the target.
        """
        found: dict[int, float] = {}
        best: Trial | None = None
        low, high = 1, self._max_qp
        qp = round(start)
        while True:
            qp = min(max(qp, low), high)
            trial = coded(qp)
            found[qp] = trial.psnr_y
            if trial.psnr_y < self._target:
                high = qp - 1
                low = qp if trial.bits >= most_bits else low  # finer ones take more yet
            else:
                best, low = (trial if trial.bits < most_bits else None), qp + 1
            if low > high or (about and abs(self._target - trial.psnr_y) <= ABOUT):
                return best, trial
            qp = guessed_qp(found, self._target, self._codec.qp_line[0])

    def _with_model(self, qp: int) -> EncoderConfig:
        config = replace(self._config, qp=qp, enhance=AUTO)
        quality = config.layer_quality(self._layer_views, len(self._array.real))
        assert quality is not None
        return replace(config, enhance=round(float(quality), DIGITS))

    def _brought(self, trial: Trial) -> Trial:
        """A trial of the same base near the target, by its layer's QP."""
        for _ in range(MOST_ROUNDS):
            gap = self._target - trial.psnr_y
            if abs(gap) <= NEAR:
                break
            other = self._with_layer(trial, _layer_qp(trial) + gap / self._layer)
            if other is None:
                break
            trial = other
        return trial

    def _with_layer(self, trial: Trial, qp: float) -> Trial | None:
        """Another layer beside the same base, which teaches slopes; None where it would be the same."""
        qp = self._layer_within(qp)
        if qp == _layer_qp(trial):
            return None
        other = self._try(replace(trial.config, enhance=qp))
        gained = other.psnr_y - trial.psnr_y
        self._layer = _within(gained / (qp - _layer_qp(trial)), self._layer)
        if gained:
            self._price = _within(math.log(other.bits / trial.bits) / gained, self._price)
        return other

    def _layer_within(self, qp: float) -> float:
        return round(min(max(qp, 1.0), float(self._max_qp)), DIGITS)

    def _moved(self, trial: Trial, direction: int) -> Trial | None:
        """The next base, with the layer that brings it to the target; None where there is none."""
        qp = _base_qp(trial) + direction
        idle = _layer_qp(trial) == self._max_qp and direction < 0  # a finer base has even less use for it
        if idle or not 1 <= qp <= self._max_qp:
            return None
        step = (self._target - trial.psnr_y - self._base * direction) / self._layer
        layer_qp = self._layer_within(_layer_qp(trial) + step)
        moved = self._try(replace(trial.config, qp=qp, enhance=layer_qp))
        by_layer = self._layer * (layer_qp - _layer_qp(trial))
        self._base = _within((moved.psnr_y - trial.psnr_y - by_layer) / direction, self._base)
        return self._brought(moved)

    def _pays(self, trial: Trial, other: Trial) -> bool:
        return self._cost(trial) < self._cost(other) - LEAST_GAIN

    def _cost(self, trial: Trial) -> float:
        """Natural logarithm of the bits that a trial would take at the target."""
        gap = self._target - trial.psnr_y
        if gap < 0 and _layer_qp(trial) == self._max_qp:
            gap = 0.0  # there is no coarser layer
        return math.log(trial.bits) + self._price * gap

    def _finished(self, probe: Trial) -> Trial:
        """The coarsest layer beside that base that is seen to reach the target, by more than was probed."""
        reached: Trial | None = None
        missed: Trial | None = None
        qp, gap = _layer_qp(probe), self._target - probe.psnr_y
        for _ in range(MOST_ROUNDS):
            qp += gap / self._layer
            if reached is not None and missed is not None:
                qp = min(max(qp, _layer_qp(reached) + LEAST_STEP), _layer_qp(missed) - LEAST_STEP)
                if qp < _layer_qp(reached) + LEAST_STEP:
                    break
            elif missed is not None:
                qp = min(qp, _layer_qp(missed) - FINER_STEP)
            qp = self._layer_within(qp)
            trial = self._check(replace(probe.config, enhance=qp))
            gap = self._target + CLOSE / 2 - trial.psnr_y
            if trial.psnr_y < self._target:
                missed = trial
            else:
                reached = trial
                if trial.psnr_y <= self._target + CLOSE:
                    break
        if reached is None:
            raise self._unreachable(trial)
        return reached

    def _finished_alone(self, probe: Trial) -> Trial:
        """The coarsest base that is seen to reach the target, by more than was probed."""
        found, last = self._coarsest(
            lambda qp: self._check(replace(probe.config, qp=qp)), float(_base_qp(probe))
        )
        if found is None:
            raise self._unreachable(last)
        return found

    def _unreachable(self, trial: Trial) -> SettingError:
        return SettingError("target_psnr", f"{self._target:g} dB", f"at most about {trial.psnr_y:.2f} dB")

    def _alone(self, best: Trial) -> Trial | None:
        """A base without a layer that reaches the target with fewer bits, if there is one."""
        finer = HALVING * self._codec.qp_line[0] * math.log2(best.bits / best.base_bits)
        second = best.config.second_reference
        bare = replace(
            self._config, enhance=None, enhance_views=None, enhance_chain=None, second_reference=second
        )
        start = _base_qp(best) - finer
        return self._coarsest(lambda qp: self._try(replace(bare, qp=qp)), start, best.bits)[0]


def _base_qp(trial: Trial) -> int:
    assert trial.config.rate.qp is not None
    return trial.config.rate.qp


def _layer_qp(trial: Trial) -> float:
    asked = trial.config.enhance
    assert isinstance(asked, int | float)
    return asked


def _within(slope: float, before: float) -> float:
    """A measured slope, but not another sign or size than slopes of its kind have."""
    low, high = sorted((before / MOST_CHANGE, before * MOST_CHANGE))
    return min(max(slope, low), high)
