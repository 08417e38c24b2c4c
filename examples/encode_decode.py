"""Code the sample array, then look from between its cameras.

python examples/encode_decode.py ARRAY_FOLDER OUT.mcap OUT.png
"""

import sys
from pathlib import Path

import cv2

import mvcodec

folder, coded, picture = (Path(argument) for argument in sys.argv[1:4])

source = mvcodec.open_input(folder)
config = mvcodec.EncoderConfig(qp=27)
with mvcodec.Encoder(source.array, config) as encoder, mvcodec.McapWriter(coded) as writer:
    for frames in source.frame_sets():
        writer.push(encoder.push(frames))

with mvcodec.open(coded) as video:
    pixels = video.render((video.array.rows - 1) / 2, (video.array.cols - 1) / 2, frame=0)
cv2.imwrite(str(picture), cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR))
