"""Rows of the benchmark of speed about decoding, rendering and the delay of a live chain."""

from __future__ import annotations

import io
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import av
from av.video.codeccontext import VideoCodecContext
from speed_measures import QP, Material, Row, bicubic, material, take_turns

from mvcodec.array import Position, Viewpoint
from mvcodec.container import McapWriter
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.frames import DecodedSet
from mvcodec.stream import Packet
from mvcodec.synthesis.synthesizers import make_synthesizer
from mvcodec.workers import run_all, thread_count

VIEWS = {"layered": (3.5, 2.5), "quick": (1.6, 1.2)}


def _decoded(made: Material) -> DecodedSet:
    with Decoder() as decoder:
        found = [decoded for packet in _packets(made, 1)[0] for decoded in decoder.push(packet)]
        return [*found, *decoder.flush()][0]


def _packets(made: Material, frames: int) -> list[list[Packet]]:
    config = EncoderConfig(qp=QP, speed="balanced", disparity_range_px=made.range_px)
    with Encoder(made.array, config) as encoder:
        return [encoder.push(frame_set) for frame_set in made.frame_sets[:frames]]


def viewing_rows() -> Iterator[Row]:
    """Virtual views over bicubic remaps of a picture, 960 x 640."""
    made = material(960, 640, (5, 5), 1)
    decoded = _decoded(made)
    remap = bicubic(made.frame_sets[0].pictures[0, 0])
    # Between the cameras and between the positions of the grid: nothing there is a special case.
    place = Viewpoint(1.6, 1.2)
    for name, goals in VIEWS.items():
        synthesizer = make_synthesizer(name)
        yield take_turns(
            f"one virtual view, {name} / one bicubic remap",
            lambda synthesizer=synthesizer: synthesizer.render(decoded, place),  # type: ignore[misc]
            remap,
            goals,
        )
    virtual = [view for view in made.array.positions if view not in made.array.real]
    synthesizer = make_synthesizer("layered")

    def render(view: Position) -> None:
        synthesizer.render(decoded, Viewpoint(*view))

    def all_views() -> None:
        run_all(render, virtual)  # side by side, as `mvcodec decode` does

    def all_remaps() -> None:
        for _ in virtual:
            remap()

    text = f"all {len(virtual)} virtual views of 5 x 5, layered / as many remaps"
    yield take_turns(text, all_views, all_remaps, (2.5, 2), repeats=3)


def decoding_rows() -> Iterator[Row]:
    """The decoder over PyAV alone on the same streams, two tracks at a time."""
    made = material(640, 480)
    packets = _packets(made, len(made.frame_sets))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "speed.mcap"
        with McapWriter(path) as writer:
            for of_one_time in packets:
                writer.push(of_one_time)
        data = path.read_bytes()
    units: dict[str, list[bytes]] = {}
    for packet in (packet for of_one_time in packets for packet in of_one_time):
        if packet.track.camera is not None:
            units.setdefault(packet.track.topic, []).append(packet.data)

    def ours() -> None:
        with Decoder.open(io.BytesIO(data)) as decoder:
            for _ in decoder:
                pass

    def decode(track: list[bytes]) -> None:
        context = VideoCodecContext.create("h264", "r")
        context.thread_count = 1
        for unit in track:
            context.decode(av.Packet(unit))
        context.decode(None)

    def theirs() -> None:
        with ThreadPoolExecutor(thread_count()) as pool:
            list(pool.map(decode, units.values()))

    def ours_and_look() -> None:
        with Decoder.open(io.BytesIO(data)) as decoder:
            for found in decoder:
                run_all(found.pictures.__getitem__, made.array.real)
                run_all(found.disparities.__getitem__, made.array.real)

    for what, work in (("decode", ours), ("decode, all pictures and maps looked at", ours_and_look)):
        text = f"{what} / PyAV alone, {thread_count()} threads"
        yield take_turns(text, work, theirs, (1.3, 1.15), units=len(packets))


def delay_row() -> Row:
    """A live chain: camera, encode, decode, one view; its delay over the stages' own time."""
    command = [sys.executable, str(Path(__file__).with_name("latency.py")), "--frames", "40"]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    # Lines such as "whole way  median   12.345 ms  99 %   20.000 ms".
    whole, stages = (float(line.split("median")[1].split()[0]) for line in printed.splitlines()[:2])
    return Row("live chain, delay / the stages' own time", whole, stages, whole, stages, 1.1, None)
