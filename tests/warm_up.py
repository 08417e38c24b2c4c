"""Loads what matching and rendering need, compiled kernels above all: most of the time of a short command.

Run as a program it compiles the kernels, which is done once after each change of them.
"""

from __future__ import annotations

import io

import cv2
import numpy as np

from mvcodec.array import Calibration, CameraArray, Viewpoint
from mvcodec.container import McapWriter
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.frames import FrameSet
from mvcodec.kernels import on_first_compilation
from mvcodec.stereo.disparity_range import estimate_range
from mvcodec.synthesis.synthesizers import SYNTHESIZERS, make_synthesizer
from mvcodec.workers import threads


class _NotCompiled(Exception):
    """A kernel would have to be compiled."""


def warm_up() -> None:
    """Load what is compiled, up to what is not. No thread stays behind, so that processes may fork."""
    warming = True

    def stop() -> None:
        if warming:
            raise _NotCompiled

    on_first_compilation(stop)
    usual = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        with threads(1):
            use_kernels()
    except _NotCompiled:
        pass
    finally:
        warming = False
        cv2.setNumThreads(usual)


def use_kernels() -> None:
    """Code and decode a small picture, and look at it by every synthesizer."""
    array = CameraArray(2, 2, 64, 48, 10.0, (0, 1), (0, 1), Calibration.nominal(64, 48))
    noise = np.random.default_rng(0).integers(0, 256, (48, 64, 3), np.uint8)
    frame_set = FrameSet(0, 0, dict.fromkeys(array.real, noise))
    file = io.BytesIO()
    estimate_range(array, [frame_set], None)
    with McapWriter(file) as writer, Encoder(array, EncoderConfig()) as encoder:
        writer.push(encoder.push(frame_set))
    file.seek(0)
    with Decoder.open(file) as decoder:
        (decoded,) = decoder
    for name in SYNTHESIZERS:
        make_synthesizer(name).render(decoded, Viewpoint(0.5, 0.5))


if __name__ == "__main__":
    use_kernels()
