"""Encode an array folder, decode it, and synthesise a view between the cameras.

python examples/round_trip.py FOLDER OUT.mcap VIEW.png
"""

import sys
from pathlib import Path

from mvcodec.array import Viewpoint
from mvcodec.capture import open_input
from mvcodec.container import McapWriter
from mvcodec.decoder import Decoder
from mvcodec.encoder import Encoder, EncoderConfig
from mvcodec.output.pictures import write_png
from mvcodec.synthesis.table import make_synthesizer

folder, coded, view = (Path(argument) for argument in sys.argv[1:])

source = open_input([folder])
with Encoder(source.array, EncoderConfig(qp=27)) as encoder, McapWriter(coded) as writer:
    for frames in source.frame_sets():
        writer.push(encoder.push(frames))  # at once: no frame waits for a later one

synthesizer = make_synthesizer("layered")
with Decoder.open(coded) as decoder:
    array = decoder.header.array
    middle = Viewpoint((array.rows - 1) / 2, (array.cols - 1) / 2)
    for decoded in decoder:
        picture = synthesizer.render(decoded, middle).pixels
        write_png(view, picture)  # the last frame's stays
