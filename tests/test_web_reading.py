"""What the page's reader takes from a web server, and what it makes of files that grow, break off or lie."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from browser_page import CHROMIUM, NO_CHROMIUM, watched_page
from coding import encoded_file, make_array
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from mcap.reader import make_reader
from mcap.writer import Writer
from player_files import damage
from playwright.sync_api import Browser, Page
from web_fixtures import Site, open_player

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)
pytest_plugins = ("web_fixtures",)

SAMPLE = Path(__file__).parent / "conformance" / "square.mcap"
"""Two groups of three frames."""
CORPUS = Path(__file__).parent / "fuzz_corpus"
GIGABYTE = 1 << 30
UNKNOWN_RECORD = 0x81
"""An opcode that readers must skip."""

READ = """async ([name, limit]) => {
    const { FileDecoder } = await import("./player.js");
    try {
        const decoder = await FileDecoder.open(name);
        let pictures = 0;
        for (let frame = 0; frame < Math.min(decoder.count, limit); frame++) {
            for (const { topic } of decoder.tracks.slice(0, 8)) {
                pictures += (await decoder.planes(topic, frame)) !== undefined;
            }
        }
        decoder.close();
        return { count: decoder.count, pictures, troubles: decoder.troubles, refused: "" };
    } catch (error) {
        return { count: 0, pictures: 0, troubles: [], refused: `${error.name}: ${error.message}` };
    }
}"""


def read(page: Page, site: Site, name: str, limit: int = 1000) -> dict[str, Any]:
    page.goto(f"{site.url}/blank.html")
    found: dict[str, Any] = page.evaluate(READ, [name, limit])
    return found


def with_a_hole(source: Path, target: Path) -> None:
    """The same messages with a record of a gigabyte, which nobody needs, before the second keyframe."""
    with source.open("rb") as file, target.open("wb") as out:
        reader = make_reader(file)
        writer = Writer(out, chunk_size=1 << 62)
        writer.start()
        channels: dict[int, int] = {}
        keyframes = 0
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            if channel.topic == "/mvcodec/header":
                keyframes += 1
                writer.flush()  # type: ignore[no-untyped-call]
                if keyframes == 2:
                    out.write(struct.pack("<BQ", UNKNOWN_RECORD, GIGABYTE))
                    out.seek(GIGABYTE, 1)
            if channel.id not in channels:
                assert schema is not None
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, number
                )
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time, message.sequence
            )
        writer.finish()  # type: ignore[no-untyped-call]
    assert keyframes > 1


def test_a_large_file_starts_after_three_requests_and_two_megabytes(tab: Page, site: Site) -> None:
    with_a_hole(SAMPLE, site.folder / "large.mcap")
    site.ranges.clear()
    open_player(tab, site, "large.mcap")
    taken = [end - start for name, start, end in site.ranges if name == "large.mcap"]
    assert len(taken) <= 3
    assert sum(taken) <= 2 << 20
    last = tab.evaluate("document.querySelector('mvcodec-player').seek(1e9).then(() => 'there')")
    assert last == "there"
    (site.folder / "large.mcap").unlink()


def test_a_connection_that_breaks_is_tried_again_and_then_told(tab: Page, site: Site) -> None:
    site.put("whole.mcap", SAMPLE.read_bytes())
    site.cuts = 2
    assert read(tab, site, "whole.mcap", 0)["count"] == 6
    site.cuts = 3  # as often as it is tried
    assert "breaks off" in read(tab, site, "whole.mcap", 0)["refused"]
    assert site.cuts == 0
    assert read(tab, site, "whole.mcap", 0)["count"] == 6


def test_a_file_that_breaks_off_is_used_up_to_there(tab: Page, site: Site) -> None:
    content = SAMPLE.read_bytes()
    site.put("whole.mcap", content)
    site.put("cut.mcap", content[: len(content) * 2 // 3])
    whole, cut = read(tab, site, "whole.mcap", 0), read(tab, site, "cut.mcap", 1)
    assert 0 < cut["count"] < whole["count"]
    assert any("breaks off" in text for text in cut["troubles"])


def test_a_growing_file_is_followed(tab: Page, site: Site) -> None:
    content = SAMPLE.read_bytes()
    site.put("growing.mcap", content[: len(content) * 2 // 3])
    open_player(tab, site, "growing.mcap")
    tab.evaluate("""() => {
        const player = document.querySelector("mvcodec-player");
        window.frames = new Set();
        player.addEventListener("frame", (event) => window.frames.add(event.detail.frame));
        player.seek(1e9).then(() => (window.lastBefore = Math.max(...window.frames)));
    }""")
    tab.wait_for_function("window.lastBefore !== undefined")
    site.put("growing.mcap", content)
    tab.wait_for_function("""async () => {
        await document.querySelector("mvcodec-player").seek(1e9);
        return Math.max(...window.frames) > window.lastBefore;
    }""")


def test_a_decoder_that_falls_silent_is_replaced_by_software(chromium: Browser, site: Site) -> None:
    """As hardware does whose sessions have run out."""
    for page in watched_page(chromium, 640, 480):
        page.add_init_script("""
            const wait = window.setTimeout;
            const shorter = { 4000: 20, 50: 1 }; // to spare our patience
            window.setTimeout = (done, ms) => wait(done, shorter[ms] ?? ms);
            const { configure, decode, flush } = VideoDecoder.prototype;
            window.silent = 0;
            VideoDecoder.prototype.configure = function (config) {
                this.isSoftware = config.hardwareAcceleration === "prefer-software";
                return configure.call(this, config);
            };
            VideoDecoder.prototype.decode = function (chunk) {
                if (this.isSoftware) return decode.call(this, chunk);
                window.silent++;
            };
            VideoDecoder.prototype.flush = function () {
                return this.isSoftware ? flush.call(this) : new Promise(() => {});
            };
        """)
        site.put("square.mcap", SAMPLE.read_bytes())
        open_player(page, site, "square.mcap", 'view="1,1"')
        assert page.evaluate("window.silent") > 0
        page.evaluate("document.querySelector('mvcodec-player').seek(5)")
        assert page.evaluate("document.querySelector('mvcodec-player').shown.frame") == 5
        assert page.evaluate("window.troubles") == []


def test_every_decoded_frame_is_closed_in_time(chromium: Browser, site: Site) -> None:
    """A decoder stalls once about eight of its frames are open."""
    for page in watched_page(chromium, 640, 480):
        page.add_init_script("""
            window.made = window.most = 0;
            window.open = new Map();
            window.VideoDecoder = class extends VideoDecoder {
                constructor({ output, error }) {
                    const frames = new Set();
                    super({ error, output: (frame) => {
                        const { close } = frame;
                        frame.close = () => (frames.delete(frame), close.call(frame));
                        frames.add(frame);
                        window.made++;
                        window.most = Math.max(window.most, frames.size);
                        output(frame);
                    } });
                    window.open.set(this, frames);
                }
            };
        """)
        content = encoded_file(make_array(fps=30.0), 30, gop=30, preset="ultrafast", matcher="sgbm")
        site.put("long.mcap", content)
        open_player(page, site, "long.mcap", 'view="0.5,0.5"')
        for frame in (29, 0, 17):
            page.evaluate("(frame) => document.querySelector('mvcodec-player').seek(frame)", frame)
        tracks = page.evaluate("window.open.size")
        assert page.evaluate("window.made") > 30 * tracks / 2
        page.wait_for_function("[...window.open.values()].every((frames) => frames.size === 0)")
        assert page.evaluate("window.most") < 8
        assert page.evaluate("window.troubles") == []


def test_damage_is_skipped_to_the_next_keyframe_and_told(tab: Page, site: Site, tmp_path: Path) -> None:
    broken = damage(SAMPLE, tmp_path / "broken.mcap", 0)
    site.put("broken.mcap", broken.read_bytes())
    found = read(tab, site, "broken.mcap", 1000)
    assert any("damage" in text for text in found["troubles"])
    assert found["count"] == 6
    assert found["pictures"] == 3 * 8  # of the second group


@pytest.mark.parametrize("kind", ["reader", "chunk", "check"])
def test_the_fuzz_corpus_is_read_without_a_hang(tab: Page, site: Site, kind: str) -> None:
    files = sorted((CORPUS / kind).iterdir())
    assert files
    tab.goto(f"{site.url}/blank.html")
    for path in files:
        site.put(path.name, path.read_bytes())
        found = tab.evaluate(READ, [path.name, 2])
        assert found["refused"].startswith(("FileError", "NoDecoder")) or not found["refused"], (path, found)


def test_a_header_that_asks_for_too_much_is_refused(tab: Page, site: Site) -> None:
    header = json.loads((Path(__file__).parent / "conformance" / "square.json").read_text())["header"]
    header["array"] |= {"width": 16384, "height": 16384}
    with (site.folder / "hostile.mcap").open("wb") as out:
        writer = Writer(out)
        writer.start()
        schema = writer.register_schema("mvcodec.Header", "jsonschema", b"{}")
        channel = writer.register_channel("/mvcodec/header", "json", schema)
        writer.add_message(channel, 0, json.dumps(header).encode(), 0, 0)
        writer.finish()  # type: ignore[no-untyped-call]
    assert "pixels of a frame set" in str(read(tab, site, "hostile.mcap"))


def changed(source: Path, target: Path, change: Callable[[int, str, bytes], bytes | None]) -> None:
    """A copy with other messages: `change` gets a frame set's number, topic and data; None leaves it out."""
    with source.open("rb") as file, target.open("wb") as out:
        reader = make_reader(file)
        writer = Writer(out)
        writer.start()
        channels: dict[int, int] = {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            if channel.id not in channels:
                assert schema is not None
                named = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, named)
            data = change(message.sequence, channel.topic, message.data)
            if data is not None:
                writer.add_message(
                    channels[channel.id], message.log_time, data, message.publish_time, message.sequence
                )
        writer.finish()  # type: ignore[no-untyped-call]


@pytest.mark.parametrize("codec", ["h264", "av1", "vp9"])
def test_pictures_that_build_on_a_lost_one_are_not_shown(tab: Page, site: Site, codec: str) -> None:
    site.put("whole.mcap", encoded_file(make_array(), 8, gop=4, codec=codec))
    whole = read(tab, site, "whole.mcap")
    tracks = whole["pictures"] // 8
    assert whole["troubles"] == []
    changed(
        site.folder / "whole.mcap", site.folder / "lost.mcap", lambda n, _, data: None if n == 2 else data
    )
    lost = read(tab, site, "lost.mcap")
    assert lost["count"] == 7
    assert lost["pictures"] == tracks * (2 + 4)  # up to the lost one, and from the next keyframe on
    assert any("cannot be decoded" in text for text in lost["troubles"])


@pytest.mark.parametrize("kind", ["header", "nal"])
def test_damaged_headers_and_pictures_do_not_hang_the_page(tab: Page, site: Site, kind: str) -> None:
    """Each of the corpus in place of a whole file's first header, or of a picture between two keyframes."""
    files = sorted((CORPUS / kind).iterdir())
    assert files
    tab.goto(f"{site.url}/blank.html")
    for path in files:
        damaged = path.read_bytes()
        if kind == "nal":
            damaged = CompressedVideo(data=damaged, format="h264").SerializeToString()
        place = (0, "/mvcodec/header") if kind == "header" else (1, "/camera/r00_c00/video")

        def change(number: int, topic: str, data: bytes) -> bytes:
            return damaged if (number, topic) == place else data  # noqa: B023

        changed(SAMPLE, site.folder / "damaged.mcap", change)
        found = tab.evaluate(READ, ["damaged.mcap", 6])
        assert found["refused"].startswith(("FileError", "NoDecoder")) or not found["refused"], (path, found)
        if kind == "nal":
            assert found["pictures"] >= 6 * 8 - 2, (path, found)  # all but those of this track and group
