"""How soon the page's picture follows a slow drag, in Chromium without a GPU.

    python benchmarks/web_slow_drag.py FILE.mcap [--steps 25] [--every-ms 200]

The picture is moved a little, then rests for some time with the button pressed, again and again.
Printed: ms from a move until its picture is drawn, the median and the longest.
"""

from __future__ import annotations

import argparse
import shutil
import statistics
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright
from web_playback import ARGUMENTS, BROWSERS, SCREEN, playing

DRAG = """async ([steps, everyMs]) => {
    const player = document.querySelector("mvcodec-player");
    await player.ready;
    await player.settled();
    const stage = player.shadowRoot.querySelector(".stage");
    const gl = player.shadowRoot.querySelector("canvas.picture").getContext("webgl2");
    stage.setPointerCapture = () => {}; // there is no such pointer
    const send = (type, clientX) =>
        stage.dispatchEvent(new PointerEvent(type, { pointerId: 1, clientX, clientY: 250, bubbles: true }));
    const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
    send("pointerdown", 400);
    const took = [];
    for (let i = 1; i <= steps; i++) {
        await pause(everyMs);
        const since = performance.now();
        const drawn = new Promise((resolve) => player.addEventListener("frame", resolve, { once: true }));
        send("pointermove", 400 + 8 * i);
        await drawn;
        const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
        gl.flush();
        while (gl.clientWaitSync(fence, 0, 0) === gl.TIMEOUT_EXPIRED) await pause(2);
        took.push(performance.now() - since);
    }
    return took;
}"""


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("file", type=Path)
    parser.add_argument("--steps", type=int, default=25, help="moves of the drag (default 25)")
    parser.add_argument("--every-ms", type=float, default=200.0, help="rest between them (default 200)")
    arguments = parser.parse_args()
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    with playing(arguments.file, "web") as (url, _pid), sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(ARGUMENTS))
        page = browser.new_page(viewport=SCREEN, reduced_motion="reduce")
        page.goto(url)
        took: list[float] = page.evaluate(DRAG, [arguments.steps, arguments.every_ms])
        browser.close()
    print(f"median {statistics.median(took):.0f} ms, longest {max(took):.0f} ms")
    return 0


if __name__ == "__main__":
    sys.exit(main())
