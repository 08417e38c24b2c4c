"""Code the sample array, then look from between its cameras.

python examples/encode_decode.py ARRAY_FOLDER OUT.mcap OUT.png
"""

import sys
from pathlib import Path

import cv2

from mvcodec import Viewpoint
from mvcodec.capture import open_input
from mvcodec.container import McapWriter
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.synthesis.synthesizers import make_synthesizer

folder, coded, picture = (Path(argument) for argument in sys.argv[1:4])

source = open_input([folder])
with Encoder(source.array, EncoderConfig(qp=27)) as encoder, McapWriter(coded) as writer:
    for frames in source.frame_sets():
        writer.push(encoder.push(frames))

synthesizer = make_synthesizer("layered")
with Decoder.open(coded, slice(0, 1)) as decoder:
    for decoded in decoder:
        middle = Viewpoint((decoded.array.rows - 1) / 2, (decoded.array.cols - 1) / 2)
        view = synthesizer.render(decoded, middle)
        cv2.imwrite(str(picture), cv2.cvtColor(view.pixels, cv2.COLOR_RGB2BGR))
