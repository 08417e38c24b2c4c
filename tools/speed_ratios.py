"""Speed of mvcodec's stages against stock code on the same pictures in the same run.

Each side runs as a caller gets it (its own threads, both cores), is warmed up once, and is repeated in turn
with the other; the medians are divided. "libx264 alone" and "PyAV alone" get planes and access units
ready-made, two tracks at a time.
"""

from __future__ import annotations

import math
import statistics
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import av
import cv2
import numpy as np
from av.video.codeccontext import VideoCodecContext

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.capture import ArraySource
from mvcodec.container.writer import McapWriter
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder, EncoderConfig, default_gop
from mvcodec.frames import DecodedSet, DisparityMap, FrameSet, Picture
from mvcodec.layers.refinement import make_matcher
from mvcodec.stereo.disparity_range import estimate_range
from mvcodec.stream import Packet, TrackKind
from mvcodec.synthesis.synthesizers import make_synthesizer
from mvcodec.video.codec import Planes, VideoSettings
from mvcodec.video.codecs import find_codec
from mvcodec.video.colour import even_size, grey_planes, to_planes
from mvcodec.video.disparity_code import quantise
from mvcodec.video.map_size import MEDIANS, coded_size, to_coded
from mvcodec.workers import thread_count

RATIOS = {
    "view": "one virtual view / one bicubic cv2.remap",
    "match": "the maps of one frame set / one StereoSGBM 3-way call",
    "encode": "the whole encoder without matching / libx264 alone",
    "decode": "the whole decoder / PyAV alone",
}
REPEATS = 7
FRAMES = 8
QP = 27

Times = tuple[float, float]
"""Seconds of (ours, theirs), medians."""


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """Frame sets of the real cameras and the maps of the first one (coded with each)."""

    array: CameraArray
    frame_sets: Sequence[FrameSet]
    maps: dict[Position, DisparityMap]
    range_px: tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Readymade:
    """A matcher that takes no time."""

    maps: dict[Position, DisparityMap]

    def match(
        self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        """See `Matcher`."""
        del array, pictures, range_px
        return self.maps


def measure_ratios(source: ArraySource, matcher: str, synthesizer: str) -> dict[str, Times]:
    """Seconds of ours and theirs for each of RATIOS."""
    frame_sets = list(source.frame_sets(slice(0, FRAMES)))
    array, first = source.array, frame_sets[0]
    range_px = estimate_range(array, frame_sets[:1], None)
    maps = make_matcher(matcher).match(array, first.pictures, range_px)
    material = Material(array, frame_sets, maps, range_px)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "speed.mcap"
        packets = _write(material, path)
        return {
            "view": _view(material, synthesizer),
            "match": _match(material, matcher),
            "encode": _encode(material),
            "decode": _decode(path, packets),
        }


def _alternate(ours: Callable[[], object], theirs: Callable[[], object]) -> Times:
    """Medians over runs that take turns, so that a busy moment of the machine hits both sides."""
    ours(), theirs()
    times: list[Times] = []
    for _ in range(REPEATS):
        started = time.perf_counter()
        ours()
        between = time.perf_counter()
        theirs()
        times.append((between - started, time.perf_counter() - between))
    return statistics.median(t for t, _ in times), statistics.median(t for _, t in times)


def _view(material: Material, synthesizer: str) -> Times:
    array, first = material.array, material.frame_sets[0]
    decoded = DecodedSet(array, first.index, first.time_ns, first.pictures, material.maps, material.range_px)
    renderer = make_synthesizer(synthesizer)
    # Between the cameras and between the positions of the grid: nothing there is a special case.
    viewpoint = Viewpoint(0.4 * (array.rows - 1), 0.3 * (array.cols - 1))
    picture = first.pictures[array.real[0]]
    height, width = picture.shape[:2]
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    x, y = x + np.float32(0.37), y + np.float32(0.21)
    return _alternate(
        lambda: renderer.render(decoded, viewpoint), lambda: cv2.remap(picture, x, y, cv2.INTER_CUBIC)
    )


def _match(material: Material, matcher: str) -> Times:
    array, pictures = material.array, material.frame_sets[0].pictures
    ours = make_matcher(matcher)
    low, high = material.range_px
    stock = cv2.StereoSGBM.create(
        minDisparity=math.floor(low),
        numDisparities=16 * math.ceil((math.ceil(high) - math.floor(low) + 1) / 16),
        blockSize=5,
        P1=8 * 3 * 25,
        P2=32 * 3 * 25,
        mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )
    pair = [pictures[camera] for camera in (array.real[0], array.real[1])]
    return _alternate(
        lambda: ours.match(array, pictures, material.range_px), lambda: stock.compute(pair[0], pair[1])
    )


def _config(material: Material) -> EncoderConfig:
    return EncoderConfig(qp=QP, matcher=Readymade(material.maps), disparity_range_px=material.range_px)


def _push_all(material: Material) -> list[list[Packet]]:
    with Encoder(material.array, _config(material)) as encoder:
        return [encoder.push(frame_set) for frame_set in material.frame_sets]


def _write(material: Material, path: Path) -> list[list[Packet]]:
    packets = _push_all(material)
    with McapWriter(path) as writer:
        for of_one_time in packets:
            writer.push(of_one_time)
    return packets


def _encode(material: Material) -> Times:
    array, config = material.array, _config(material)
    scale = config.scale_for(array)
    sizes = {
        TrackKind.TEXTURE: even_size(array.width, array.height),
        TrackKind.DISPARITY: coded_size(array.width, array.height, scale),
    }
    tracks: list[tuple[VideoSettings, list[Planes]]] = []
    rates = {
        TrackKind.TEXTURE: config.rate_of_pictures(array),
        TrackKind.DISPARITY: config.rate_of_maps(array, material.range_px),
    }
    for kind, (width, height) in sizes.items():
        rate = rates[kind]
        settings = VideoSettings(
            kind, width, height, array.fps, default_gop(array.fps), rate, config.chosen_preset
        )
        for camera in array.real:
            if kind is TrackKind.TEXTURE:
                planes = [to_planes(frame_set.pictures[camera]) for frame_set in material.frame_sets]
            else:
                codes = quantise(material.maps[camera].values_px, material.range_px)
                planes = [grey_planes(to_coded(codes, scale, MEDIANS[scale]))] * len(material.frame_sets)
            tracks.append((settings, planes))

    def code(track: tuple[VideoSettings, list[Planes]]) -> None:
        encoder = find_codec("h264").encoder(track[0])
        for number, planes in enumerate(track[1]):
            encoder.push(planes, keyframe=number % track[0].gop == 0)
        encoder.flush()

    with ThreadPoolExecutor(thread_count()) as pool:
        return _alternate(lambda: _push_all(material), lambda: list(pool.map(code, tracks)))


def _decode(path: Path, packets: Sequence[Sequence[Packet]]) -> Times:
    units: dict[str, list[bytes]] = {}
    for packet in (packet for of_one_time in packets for packet in of_one_time):
        if packet.track.camera is not None:
            units.setdefault(packet.track.topic, []).append(packet.data)

    def ours() -> None:
        with Decoder.open(path) as decoder:
            for _ in decoder:
                pass

    def decode(track: list[bytes]) -> None:
        context = VideoCodecContext.create("h264", "r")
        context.thread_count = 1
        for data in track:
            context.decode(av.Packet(data))
        context.decode(None)

    with ThreadPoolExecutor(thread_count()) as pool:
        return _alternate(ours, lambda: list(pool.map(decode, units.values())))
