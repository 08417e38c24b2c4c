"""How the page keeps up in a browser: pictures a second that it draws itself, or that a server draws.

    python benchmarks/web_playback.py FILE.mcap [--seconds 8] [--rounds 3]

`mvcodec play` plays in a loop while the picture is dragged all the time, by turns with its page, which
decodes and draws by itself, and with `--renderer server`. Chromium, headless, is told to do without a GPU:
its WebGL is SwiftShader, software.
Printed for each round: pictures a second, CPU ms for each (browser and server together), the sides of the
pictures as a share of full size, and how much of the machine others took: without that no rate means much.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, Page, ViewportSize, sync_playwright

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
ARGUMENTS = ("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run")
SCREEN: ViewportSize = {"width": 1280, "height": 720}
WARM_UP_S = 4.0
TICK_S = 1 / os.sysconf("SC_CLK_TCK")

COUNT = """async () => {
    const player = document.querySelector("mvcodec-player");
    await player.ready;
    const canvases = [...player.shadowRoot.querySelectorAll("canvas.picture, canvas.draft")];
    window.tally = { pictures: 0, widths: 0 };
    player.addEventListener("frame", () => {
        window.tally.pictures++;
        window.tally.widths += canvases.findLast((canvas) => !canvas.hidden).width;
    });
    player.play();
}"""
"""Counts each picture on the screen, and adds up how wide they were."""

DRAG = """() => {
    const stage = document.querySelector("mvcodec-player").shadowRoot.querySelector(".stage");
    const { innerWidth: width, innerHeight: height } = window;
    const move = (ms) => {
        const clientX = width * (0.5 + 0.3 * Math.cos(0.0023 * ms));
        const clientY = height * (0.5 + 0.3 * Math.sin(0.0019 * ms));
        const at = { pointerId: 1, pointerType: "mouse", buttons: 1, clientX, clientY };
        stage.dispatchEvent(new PointerEvent("pointermove", at));
        requestAnimationFrame(move);
    };
    requestAnimationFrame(move);
}"""
"""Goes round the middle of the picture with the button pressed, once for each picture of the screen.

A mouse that is moved from outside of the browser moves 40 times a second at most: no more pictures come then.
"""

RENDERERS = ("web", "server")


@contextmanager
def playing(path: Path, renderer: str) -> Iterator[tuple[str, int]]:
    """Run ``mvcodec play``; its address and its process id."""
    command = [sys.executable, "-m", "mvcodec", "play", str(path), "--no-browser", "--renderer", renderer]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield process.stdout.readline().split()[0], process.pid
    finally:
        process.terminate()
        process.wait()
        process.stdout.close()


def measure(browser: Browser, path: Path, renderer: str, seconds: float) -> str:
    """One round, as a line."""
    with playing(path, renderer) as (url, pid):
        page = browser.new_page(viewport=SCREEN, reduced_motion="reduce")
        page.set_default_timeout(0)  # kernels may have to be compiled first
        page.goto(url)
        page.evaluate(COUNT)
        page.mouse.move(SCREEN["width"] / 2, SCREEN["height"] / 2)
        page.mouse.down()
        page.evaluate(DRAG)
        page.wait_for_timeout(1000 * WARM_UP_S)
        before, cpu_s, (busy_s, all_s), start = tally(page), family_cpu_s(pid), machine_s(), time.monotonic()
        page.wait_for_timeout(1000 * seconds)
        took_s, own_s = time.monotonic() - start, family_cpu_s(pid) - cpu_s
        busy_s, all_s = (after - earlier for after, earlier in zip(machine_s(), (busy_s, all_s), strict=True))
        after = tally(page)
        page.close()
    pictures, widths = (after[name] - before[name] for name in ("pictures", "widths"))
    sides = widths / pictures / picture_width(path)
    others = max(0.0, busy_s - own_s) / all_s
    return (
        f"{renderer:6} {pictures / took_s:5.1f} pictures/s, {1000 * own_s / pictures:5.1f} ms CPU each, "
        f"sides {sides:4.0%}; others took {others:.0%} of the machine"
    )


def tally(page: Page) -> dict[str, float]:
    found: dict[str, float] = page.evaluate("window.tally")
    return found


def picture_width(path: Path) -> float:
    from mvcodec.decoding.decoder import Decoder

    with Decoder.open(path) as decoder:
        return decoder.header.array.width


def family_cpu_s(server: int) -> float:
    """CPU seconds so far of the server and of the browser, which descends from this process."""
    parents: dict[int, int] = {}
    spent: dict[int, int] = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            name, fields = (folder / "stat").read_text().rsplit(")", 1)
        except OSError:
            continue  # it has ended
        values = fields.split()
        parents[int(folder.name)] = int(values[1])
        if int(folder.name) == server or "chrom" in name:
            spent[int(folder.name)] = int(values[11]) + int(values[12])

    def is_ours(process: int) -> bool:
        while process in parents:
            if process == os.getpid():
                return True
            process = parents[process]
        return False

    return TICK_S * sum(ticks for process, ticks in spent.items() if is_ours(process))


def machine_s() -> tuple[float, float]:
    """(busy, all) CPU seconds of the whole machine so far."""
    fields = [TICK_S * int(value) for value in Path("/proc/stat").read_text().splitlines()[0].split()[1:9]]
    return sum(fields) - fields[3] - fields[4], sum(fields)


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("file", type=Path)
    parser.add_argument("--seconds", type=float, default=8.0, help="of each round (default 8)")
    parser.add_argument("--rounds", type=int, default=3, help="(default 3)")
    arguments = parser.parse_args()
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(ARGUMENTS))
        for _ in range(arguments.rounds):
            for renderer in RENDERERS:
                print(measure(browser, arguments.file, renderer, arguments.seconds), flush=True)
        browser.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
