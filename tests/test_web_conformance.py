"""The browser's decoder against the conformance pairs: header, times and planes, bit by bit."""

from __future__ import annotations

import base64
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser_page import CHROMIUM, NO_CHROMIUM, pixels_of
from playwright.sync_api import Page, expect
from web_fixtures import Site, open_player

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)
pytest_plugins = ("web_fixtures",)

FOLDER = Path(__file__).parent / "conformance"
NAMES = sorted(path.stem for path in FOLDER.glob("*.mcap"))
NEEDS_REFERENCES = ("/predicted", "/enhanced")

READ = """async (name) => {
    const { FileDecoder } = await import("./player.js");
    const decoder = await FileDecoder.open(name);
    const text = (bytes) => btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
    const frames = [];
    let refused = "";
    for (let number = 0; number < decoder.count; number++) {
        const { index, timeNs } = await decoder.frame(number);
        const planes = {};
        for (const { topic } of decoder.tracks) {
            try {
                const found = await decoder.planes(topic, number);
                planes[topic] = [found.width, text(found.y), text(found.u), text(found.v)];
            } catch (error) {
                if (error.name !== "NoDecoder") throw error;
                refused = error.message;
            }
        }
        frames.push({ index, time_ns: String(timeNs), planes });
    }
    decoder.close();
    return { header: decoder.header.document, frames, refused, troubles: decoder.troubles };
}"""


def read(page: Page, site: Site, name: str) -> dict[str, Any]:
    site.put(f"{name}.mcap", (FOLDER / f"{name}.mcap").read_bytes())
    page.goto(f"{site.url}/blank.html")
    found: dict[str, Any] = page.evaluate(READ, f"{name}.mcap")
    return found


def checksum(text: str, stride: int, width: int, height: int) -> int:
    plane = np.frombuffer(base64.b64decode(text), np.uint8).reshape(-1, stride)
    return zlib.crc32(plane[:height, :width].tobytes())


def checksums(planes: list[Any], header: dict[str, Any], topic: str) -> list[int]:
    """Of a decoded track's planes, cropped as FORMAT.md says."""
    stride, luma, *chroma = planes
    width, height = header["array"]["width"], header["array"]["height"]
    if topic.endswith("/disparity"):
        scale = header.get("disparity_scale", 1)
        return [checksum(luma, stride, -(-width // scale), -(-height // scale))]
    half = -(-stride // 2), -(-width // 2), -(-height // 2)
    return [checksum(luma, stride, width, height), *(checksum(plane, *half) for plane in chroma)]


@pytest.mark.parametrize("name", NAMES)
def test_every_pair_is_read_as_it_says(tab: Page, site: Site, name: str) -> None:
    expected = json.loads((FOLDER / f"{name}.json").read_text("utf-8"))
    found = read(tab, site, name)
    assert found["header"] == expected["header"]
    assert found["troubles"] == []
    assert [(frame["index"], int(frame["time_ns"])) for frame in found["frames"]] == [
        (frame["index"], frame["time_ns"]) for frame in expected["frame_sets"]
    ]
    if found["refused"]:  # Debian's Chromium has no HEVC
        assert expected["header"]["codec"] == "hevc"
        assert "hevc" in found["refused"]
        return
    for got, frame in zip(found["frames"], expected["frame_sets"], strict=True):
        sums = {
            topic: checksums(planes, expected["header"], topic) for topic, planes in got["planes"].items()
        }
        # No browser can be given a reference picture, which predicted cameras and enhanced views need.
        base = {topic: crc for topic, crc in frame["crc32"].items() if not topic.endswith(NEEDS_REFERENCES)}
        assert sums == base


def test_of_predicted_cameras_those_that_play_alone_are_shown_and_it_says_so(tab: Page, site: Site) -> None:
    site.put("predicted.mcap", (FOLDER / "predicted.mcap").read_bytes())
    open_player(tab, site, "predicted.mcap", 'view="1.5,3"')
    expect(tab.get_by_role("alert")).to_contain_text("5 of this file's cameras")
    shown = tab.evaluate("document.querySelector('mvcodec-player').shown")
    assert shown["view"] == {"row": 0, "col": 0}
    assert pixels_of(tab).std() > 10
    assert tab.evaluate("window.troubles") == []


def test_without_maps_the_nearest_camera_is_shown_and_it_says_so(tab: Page, site: Site) -> None:
    site.put("no_maps.mcap", (FOLDER / "no_maps.mcap").read_bytes())
    open_player(tab, site, "no_maps.mcap", 'view="0.9,0.2"')
    expect(tab.get_by_role("alert")).to_contain_text("no disparity maps")
    header = json.loads((FOLDER / "no_maps.json").read_text("utf-8"))["header"]["array"]
    shown = tab.evaluate("document.querySelector('mvcodec-player').shown")
    assert shown["view"]["row"] in header["real_rows"]
    assert shown["view"]["col"] in header["real_cols"]
