"""What pictures need is compiled, or loaded compiled, before the first viewer moves."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

SAMPLE = Path(__file__).parents[1] / "samples" / "room_2x2.mcap"

IN_A_FRESH_PROCESS = """
import sys
from mvcodec import Decoder, Viewpoint, make_synthesizer
from mvcodec.player.warming import warm_up_beside

def ready():
    modules = [module for name, module in sys.modules.items() if name.startswith("mvcodec.kernels.")]
    kernels = [item for module in modules for item in vars(module).values() if hasattr(item, "signatures")]
    return {(str(kernel), signature) for kernel in kernels for signature in kernel.signatures}

with Decoder.open(sys.argv[1], slice(1)) as decoder:
    (decoded,) = decoder
makers = [lambda: make_synthesizer("layered"), lambda: make_synthesizer("quick")]
warm_up_beside(makers, lambda: print("compiling")).join()
before = ready()
for make in makers:
    make().render(decoded, Viewpoint(0.3, 0.8))
assert len(before) > 10
print("more:", *(kernel for kernel, _ in ready() - before))
"""


def test_a_view_of_any_file_finds_everything_ready() -> None:
    command = [sys.executable, "-c", IN_A_FRESH_PROCESS, str(SAMPLE)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "more:"
