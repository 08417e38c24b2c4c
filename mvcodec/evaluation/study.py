"""A rate-distortion study: which curves there are, and measuring their points, side by side and only once."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

from mvcodec.capture import ArraySource
from mvcodec.encoding.encoder import EncoderConfig, default_gop, find_matcher
from mvcodec.errors import OutputError, SettingError
from mvcodec.evaluation.anchors import ANCHORS, SIMULCAST, Anchor, code_array, sequence_settings
from mvcodec.evaluation.bd import RatePoint, hull
from mvcodec.evaluation.chain import measure_chain
from mvcodec.evaluation.fingerprint import (
    CHAIN,
    InputFacts,
    anchors_code,
    chain_libraries,
    code_digest,
    measuring_versions,
)
from mvcodec.evaluation.points import BitsSplit, CurvePoint, PointStore
from mvcodec.evaluation.remembered import MapSpool, Remembered
from mvcodec.layers.refinement import matcher_settings, matcher_specification
from mvcodec.synthesis.synthesizers import SYNTHESIZER_PLUGINS, make_synthesizer
from mvcodec.video.codec import RateControl
from mvcodec.video.codecs import ANCHOR_CODECS, CODECS, find_codec
from mvcodec.video.pyav import library_versions
from mvcodec.workers import Job, settle, submit, threads

OURS, BASE, ENHANCED = "mvcodec", "mvcodec-base", "mvcodec-enhanced"
"""With an enhancement layer, the first is the hull of the other two: the base alone, and with its layer."""


@dataclass(frozen=True, slots=True)
class Study:
    """What to measure.

    Attributes:
        qps: of the pictures, on the scale of config.codec; ascending.
        config: of the encoder; its qp is replaced by each of `qps`, and its matcher has a name.
        synthesizer: name.
        anchors: keys of ANCHORS. Simulcast without B-frames is measured in any case.
        anchor_codecs: keys of CODECS.
        jobs: anchors that are coded side by side, one thread each.

    Raises:
        SettingError: an unknown name, or no QP.
    """

    qps: tuple[int, ...]
    config: EncoderConfig
    synthesizer: str
    anchors: tuple[str, ...] = tuple(ANCHORS)
    anchor_codecs: tuple[str, ...] = ANCHOR_CODECS
    jobs: int = 1

    def __post_init__(self) -> None:
        if not self.qps or any(a >= b for a, b in zip(self.qps, self.qps[1:], strict=False)):
            raise SettingError("qps", ",".join(map(str, self.qps)), "one or more QPs, ascending")
        for name in self.anchors:
            if name not in ANCHORS:
                raise SettingError("anchors", name, f"some of {', '.join(ANCHORS)}")
        for name in self.anchor_codecs:
            find_codec(name, "anchor_codecs")
        for qp in self.qps:
            replace(self.config, qp=qp)

    @property
    def curves(self) -> tuple[Curve, ...]:
        """mvcodec's own curve, then the anchors, those of its own codec first."""
        own = self.config.codec
        codecs = sorted(self.anchor_codecs, key=lambda codec: codec != own)
        found = {(SIMULCAST.name, own): Curve(SIMULCAST.name, own, self.qps, SIMULCAST)}
        for codec in codecs:
            qps = translate_qps(self.qps, own, codec)
            for anchor in (anchor for family in self.anchors for anchor in ANCHORS[family]):
                name = anchor.name if codec == own else f"{anchor.name}-{codec}"
                found.setdefault((anchor.name, codec), Curve(name, codec, qps, anchor))
        names = (OURS,) if self.config.enhance is None else (OURS, BASE, ENHANCED)
        return *(Curve(name, own, self.qps, None) for name in names), *found.values()


@dataclass(frozen=True, slots=True)
class Curve:
    """One curve of a study.

    Attributes:
        name: as report.json has it: mvcodec, or the anchor's, with its codec where that is not
            mvcodec's own.
        codec: key of CODECS.
        qps: on the codec's own scale.
        anchor: None for mvcodec's own curve.
    """

    name: str
    codec: str
    qps: tuple[int, ...]
    anchor: Anchor | None

    @property
    def label(self) -> str:
        """For legends and tables."""
        if self.anchor is None:
            what = {OURS: OURS, BASE: f"{OURS}, base alone", ENHANCED: f"{OURS}, base and layer"}[self.name]
        else:
            what = self.anchor.title
        return f"{what}, {CODECS[self.codec].title}"


def translate_qps(qps: tuple[int, ...], source: str, target: str) -> tuple[int, ...]:
    """The QPs of another codec that come closest in quality, without repetition."""
    (from_slope, from_offset), (slope, offset) = find_codec(source).qp_line, find_codec(target).qp_line
    if (from_slope, from_offset) == (slope, offset):
        return qps
    found = [slope * (qp - from_offset) / from_slope + offset for qp in qps]
    top = find_codec(target).max_qp
    return tuple(dict.fromkeys(min(max(round(qp), 1), top) for qp in found))


class StudyStopped(Exception):
    """Raised inside of jobs to end them after an interruption."""


class StudyRun:
    """One run of a study on an input.

    Args:
        chosen: frame numbers, consecutive.
        facts: of the input.
        store: keeps the points; those that it holds are not measured again.
        on_pictures: called, from any thread, with how many more pictures were coded or measured.
    """

    def __init__(
        self,
        study: Study,
        source: ArraySource,
        chosen: range,
        facts: InputFacts,
        store: PointStore,
        on_pictures: Callable[[int], object],
    ) -> None:
        self.study, self.source, self.chosen, self.facts, self.store = study, source, chosen, facts, store
        self._on_pictures = on_pictures
        self._stop = threading.Event()
        self._maps = MapSpool(store.folder)
        self._chain_code = code_digest(CHAIN)
        self.gop = study.config.gop or default_gop(source.array.fps)

    @property
    def picture_count(self) -> int:
        """What `on_pictures` counts to."""
        return sum(len(curve.qps) * self.pictures_of(curve) for curve in self.measured_curves)

    @property
    def measured_curves(self) -> tuple[Curve, ...]:
        """The curves whose points are measured: all but the hull of others."""
        return tuple(curve for curve in self.study.curves if not self._is_hull(curve))

    def _is_hull(self, curve: Curve) -> bool:
        return curve.name == OURS and self.study.config.enhance is not None

    def with_hull(self, points: dict[str, list[CurvePoint]]) -> dict[str, list[CurvePoint]]:
        """The measured points, and where there is an enhancement layer the hull of mvcodec's own."""
        if self.study.config.enhance is None:
            return points
        found = {_place(point): point for name in (BASE, ENHANCED) for point in points[name]}
        return {OURS: [found[place] for place in hull(list(found))], **points}

    def _config(self, curve: Curve, qp: int) -> EncoderConfig:
        config = replace(self.study.config, qp=qp)
        return replace(config, enhance=None, enhance_views=None) if curve.name == BASE else config

    def measure(self) -> dict[str, list[CurvePoint]]:
        """The points of every curve by its name.

        mvcodec's own, one at a time, since they use all cores; then the anchors, in jobs.

        Raises:
            SettingError, InputError, OutputError: as the stages raise them.
        """
        points: dict[str, list[CurvePoint]] = {}
        waiting: dict[str, list[Job[CurvePoint]]] = {}
        with self._maps:
            try:
                for curve in self.measured_curves:
                    if curve.anchor is None:
                        points[curve.name] = [self.point(curve, qp) for qp in curve.qps]
                with threads(self.study.jobs):
                    for curve in self.study.curves:
                        if curve.anchor is not None:
                            waiting[curve.name] = [submit(self.point, curve, qp) for qp in curve.qps]
                for name, jobs in waiting.items():
                    points[name] = [job.result() for job in jobs]
            except BaseException:
                self._stop.set()
                left = [job for jobs in waiting.values() for job in jobs]
                for job in left:
                    job.cancel()
                settle(left)
                raise
        return self.with_hull(points)

    def options(self, curve: Curve, qp: int) -> Mapping[str, Any]:
        """What a point is coded with, as plain JSON values."""
        if curve.anchor is None:
            settings = {**asdict(self._config(curve, qp)), "gop": self.gop}
            settings |= settings.pop("rate")
            del settings["threads"]  # which changes no bit
            return {**settings, **self._plugins()}
        tour = curve.anchor.tours(self.source.array)[0]
        settings = find_codec(curve.codec).options(
            sequence_settings(
                self.source.array,
                curve.anchor,
                tour,
                rate=RateControl(qp=qp),
                gop=self.gop,
                preset=self.study.config.chosen_preset,
                keyframe_ratio=self.study.config.keyframe_ratio,
            )
        )
        return {"codec": curve.codec, "gop": self.gop, **settings}

    def _plugins(self) -> dict[str, Any]:
        """Matcher and synthesizer in full, so that a changed default makes another point."""
        matcher = self.study.config.chosen_matcher
        assert isinstance(matcher, str)
        synthesizer = SYNTHESIZER_PLUGINS.choose(self.study.synthesizer)
        return {
            "matcher": matcher_specification(matcher),
            "matcher_settings": matcher_settings(matcher),
            "synthesizer": synthesizer.specification(),
            "synthesizer_settings": synthesizer.all_settings(),
        }

    def depends_on(self, curve: Curve, qp: int) -> dict[str, Any]:
        """All that a point depends on, as plain JSON values; automatic choices as they fall."""
        found = {
            "curve": OURS if curve.anchor is None else curve.anchor.name,
            "options": self.options(curve, qp),
            "input": self.facts.digest,
            "code": anchors_code() if curve.anchor else self._chain_code,
            "libraries": library_versions() if curve.anchor else chain_libraries(),
        }
        return found if curve.anchor else {**found, "maps": self._map_settings(self._config(curve, qp))}

    def _map_settings(self, config: EncoderConfig) -> dict[str, Any]:
        array = self.source.array
        span = config.disparity_range_px
        return {
            "scale": config.scale_for(array),
            "cameras": config.cameras_for(array),
            "median": config.median_for(array),
            # Without a range the encoder estimates one from the pictures, and chooses by that.
            "rate": None if span is None else asdict(config.rate_of_maps(array, span)),
        }

    def pictures_of(self, curve: Curve) -> int:
        """What `on_pictures` counts for each point of a curve."""
        return self._weight(curve) * len(self.chosen) * len(self.source.array.positions)

    def point(self, curve: Curve, qp: int) -> CurvePoint:
        """A point of a curve, measured unless the store holds it.

        Raises:
            SettingError, InputError, OutputError: as the stages raise them.
        """
        depends_on = self.depends_on(curve, qp)
        name = self.store.name(depends_on)
        point = self.store.find(name)
        if point is not None:
            self._on_pictures(self.pictures_of(curve))
            return point
        point = self._anchor_point(curve, qp) if curve.anchor else self._own_point(curve, name, qp)
        point = replace(point, versions=measuring_versions())
        self.store.keep(name, point, depends_on)
        return point

    def _own_point(self, curve: Curve, name: str, qp: int) -> CurvePoint:
        try:
            self.store.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(self.store.folder, error.strerror or error) from None
        return measure_chain(
            self.source,
            self.chosen,
            self._config(curve, qp),
            Remembered(find_matcher(self.study.config.chosen_matcher), self._maps),
            make_synthesizer(self.study.synthesizer),
            self.store.folder / f"{name}.mcap",
            partial(self._on_pictures, 1),
        )

    def _anchor_point(self, curve: Curve, qp: int) -> CurvePoint:
        assert curve.anchor is not None
        coded = code_array(
            self.source,
            slice(self.chosen.start, self.chosen.stop),
            anchor=curve.anchor,
            codec=curve.codec,
            rate=RateControl(qp=qp),
            gop=self.gop,
            preset=self.study.config.chosen_preset,
            keyframe_ratio=self.study.config.keyframe_ratio,
            threads=1,
            on_picture=self._go_on,
        )
        return CurvePoint(
            qp=qp,
            bits=coded.bits,
            kbps=coded.bits * self.source.array.fps / len(self.chosen) / 1000,
            quality=coded.quality,
            split=BitsSplit(coded.bits, 0, 0),
            encode_seconds=coded.encode_seconds,
            decode_seconds=coded.decode_seconds,
        )

    def _go_on(self) -> None:
        if self._stop.is_set():
            raise StudyStopped
        self._on_pictures(1)

    @staticmethod
    def _weight(curve: Curve) -> int:
        """How often each picture is counted: an anchor codes and measures it."""
        return 1 if curve.anchor is None else 2


def _place(point: CurvePoint) -> RatePoint:
    decibel = point.quality.psnr_y.all
    assert decibel is not None
    return point.kbps, decibel
