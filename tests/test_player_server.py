"""The server by itself: what it serves, whom it refuses, and that it bears bad messages and many viewers."""

from __future__ import annotations

import argparse
import http.client
import ipaddress
import json
import random
import sys
import urllib.request
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import urlsplit

import cv2
import numpy as np
import pytest
from command_line import fails
from player_files import (
    FRAMES,
    GOP,
    SYNTHESIZER,
    Running,
    Viewer,
    damage,
    decode_picture,
    playing,
    write_original,
)
from websockets.exceptions import ConnectionClosed, InvalidStatus

from mvcodec.array import Viewpoint
from mvcodec.capture import open_input
from mvcodec.cli import play
from mvcodec.decoding.decoder import Decoder
from mvcodec.depth import depth_m
from mvcodec.errors import MissingExtra
from mvcodec.evaluation.metrics import psnr, ssim
from mvcodec.player.access import AccessRules, is_loopback
from mvcodec.player.looks import LOOKS
from mvcodec.player.messages import MAX_MESSAGE_BYTES
from mvcodec.player.serving import page_url
from mvcodec.synthesis.synthesizers import make_synthesizer

pytest_plugins = ("player_fixtures",)

CLIENTS = 20


def get(server: Running, path: str, host: str | None = None) -> http.client.HTTPResponse:
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
    connection.putrequest("GET", path, skip_host=host is not None)
    if host is not None:
        connection.putheader("Host", host)
    connection.endheaders()
    response = connection.getresponse()
    response.read()
    return response


def test_serves_its_page_and_nothing_else(server: Running) -> None:
    page = get(server, "/")
    assert page.status == 200
    assert "default-src 'none'" in (page.getheader("Content-Security-Policy") or "")
    assert get(server, "/player.js").status == 200
    for path in ("/../server.py", "/%2e%2e/server.py", "/page/", "/room.mcap", "//etc/passwd", "/player.js/"):
        assert get(server, path).status in (307, 404), path


def test_refuses_other_hosts(server: Running) -> None:
    assert get(server, "/", f"localhost:{server.port}").status == 200
    for host in ("evil.example", "127.0.0.1.evil.example", f"[::2]:{server.port}", "192.168.1.9", ""):
        assert get(server, "/", host).status in (400, 403), host


def test_refuses_pages_of_other_sites(server: Running) -> None:
    with Viewer(server, origin=server.url.rstrip("/")) as viewer:
        assert viewer.hello["type"] == "hello"
    for origin in ("http://evil.example", "null", "http://127.0.0.1:1", f"ftp://127.0.0.1:{server.port}"):
        with pytest.raises(InvalidStatus):
            Viewer(server, origin=origin)


@pytest.mark.parametrize(
    ("bound", "host", "allowed"),
    [
        ("127.0.0.1", "[::1]:80", True),
        ("127.0.0.1", "LOCALHOST", True),
        ("127.0.0.1", "10.0.0.1:80", False),
        ("127.0.0.1", None, False),
        ("127.0.0.1", "[", False),
        ("127.0.0.1", "a b", False),
        ("0.0.0.0", "10.0.0.1:80", True),
        ("0.0.0.0", "evil.example:80", False),
        ("player.example", "player.example:80", True),
    ],
)
def test_host_rules(bound: str, host: str | None, allowed: bool) -> None:
    assert AccessRules(bound).allows_host(host) is allowed


@pytest.mark.parametrize("host", ["127.0.0.1", "::1", "localhost", "127.9.9.9"])
def test_loopback(host: str) -> None:
    assert is_loopback(host)
    assert not is_loopback("0.0.0.0")


def test_greets_with_the_facts(server: Running) -> None:
    with Viewer(server) as viewer:
        hello = viewer.hello
    assert (hello["rows"], hello["cols"]) == (3, 3)
    assert (hello["real_rows"], hello["real_cols"]) == ([0, 2], [0, 2])
    assert hello["looks"] == list(LOOKS)
    assert hello["times_s"] == pytest.approx([number / 24 for number in range(FRAMES)])
    assert hello["cut_off"] is None


@pytest.mark.parametrize(("row", "col", "frame"), [(1.0, 1.0, 0), (0.0, 2.0, 7), (0.5, 1.25, 11)])
def test_sends_the_picture_that_the_library_renders(
    server: Running, file: Path, row: float, col: float, frame: int
) -> None:
    with Decoder.open(file, slice(frame, frame + 1)) as decoder:
        (decoded,) = decoder
    expected = make_synthesizer(SYNTHESIZER).render(decoded, Viewpoint(row, col)).pixels
    with Viewer(server) as viewer:
        viewer.say("move", row=row, col=col)
        viewer.say("seek", frame=frame)
        viewer.say("ready")
        received = viewer.next_picture()
    assert (received.facts["row"], received.facts["col"], received.facts["frame"]) == (row, col, frame)
    assert received.facts["time_s"] == decoded.time_ns / 1e9
    assert psnr(expected, received.picture) > 35


def test_tells_what_is_under_the_pointer(server: Running, file: Path) -> None:
    with Decoder.open(file, slice(0, 1)) as decoder:
        (decoded,) = decoder
    view = make_synthesizer(SYNTHESIZER).render(decoded, Viewpoint(1, 1))
    with Viewer(server) as viewer:
        viewer.say("move", row=1, col=1)
        viewer.say("ready")
        viewer.next_picture()
        viewer.say("probe", x=0.25, y=1)
        told = next(
            message for message in viewer.socket if isinstance(message, str) and "disparity" in message
        )
    place = json.loads(told)
    expected = view.disparity_px[-1, view.disparity_px.shape[1] // 4]
    assert place["disparity_px"] == pytest.approx(expected, abs=1.5)
    assert place["depth_m"] == pytest.approx(
        depth_m(decoded.array, view.disparity_px)[-1, view.disparity_px.shape[1] // 4], rel=0.1
    )


def test_measures_against_the_original(server: Running, file: Path, original: Path) -> None:
    with Decoder.open(file, slice(5, 6)) as decoder:
        (decoded,) = decoder
    rendered = make_synthesizer(SYNTHESIZER).render(decoded, Viewpoint(1, 0)).pixels
    (frames,) = open_input([original]).frame_sets(slice(5, 6), [(1, 0)])
    with Viewer(server) as viewer:
        for kind, fields in (("seek", {"frame": 5}), ("move", {"row": 1, "col": 0})):
            viewer.say(kind, **fields)
        viewer.say("show", look="difference")
        viewer.say("ready")
        quality = viewer.next_picture().facts["quality"]
        assert quality["psnr_db"] == pytest.approx(psnr(frames.pictures[1, 0], rendered))
        assert quality["ssim"] == pytest.approx(ssim(frames.pictures[1, 0], rendered))


def test_hands_out_small_pictures_of_the_nearest_camera_at_the_keyframe_before(
    server: Running, file: Path
) -> None:
    with Decoder.open(file, slice(GOP, GOP + 1)) as decoder:
        (decoded,) = decoder
    with urllib.request.urlopen(f"{server.url}thumbnail/{GOP + 2}?row=0.3&col=1.4") as answer:
        found = decode_picture(np.frombuffer(answer.read(), np.uint8))
    whole = decoded.pictures[0, 2]
    expected = cv2.resize(
        whole, (160, round(160 * whole.shape[0] / whole.shape[1])), interpolation=cv2.INTER_AREA
    )
    assert psnr(np.asarray(expected, np.uint8), found) > 33
    assert get(server, f"/thumbnail/{FRAMES}?row=0&col=0").status == 404
    for place in ("", "?row=0", "?row=x&col=0"):
        assert get(server, f"/thumbnail/0{place}").status == 400
    assert get(server, "/thumbnail/0?row=0&col=0", "evil.example").status == 403


def test_malformed_messages_close_their_connection_and_no_other(server: Running) -> None:
    malformed: list[str | bytes] = [
        "nonsense",
        b"\x00\x01",
        '{"type": "move", "row": "0", "col": 0}',
        "x" * (MAX_MESSAGE_BYTES + 1),
        "[" * 500,
    ]
    with Viewer(server) as other:
        other.say("ready")
        other.next_picture()
        for message in malformed:
            with Viewer(server) as viewer:
                viewer.say("ready")
                viewer.socket.send(message)
                with pytest.raises(ConnectionClosed) as closed:
                    viewer.take_all()
                assert closed.value.rcvd is not None
                assert closed.value.rcvd.code in (1008, 1009)
        other.say("move", row=0.5, col=0.5)
        assert other.next_picture().facts["row"] == 0.5


def test_rubbish_of_any_kind_leaves_the_server_serving(server: Running) -> None:
    rng = random.Random(11)
    for _ in range(40):
        with Viewer(server) as viewer:
            viewer.socket.send(rng.randbytes(rng.randrange(200)))
    with Viewer(server) as viewer:
        viewer.say("ready")
        assert viewer.next_picture().facts["frame"] == 0


def test_a_viewer_that_draws_nothing_gets_two_pictures(server: Running) -> None:
    with Viewer(server) as viewer:
        viewer.say("ready")
        viewer.say("loop", loop=True)
        viewer.say("play", playing=True)
        with pytest.raises(TimeoutError):
            viewer.take_all(1.5)
    assert viewer.undrawn == 2


def test_plays_to_the_end_and_goes_back_from_there(server: Running) -> None:
    with Viewer(server) as viewer:
        viewer.say("speed", factor=4)
        viewer.say("play", playing=True)
        viewer.say("ready")
        assert viewer.picture_of(frame=FRAMES - 1).facts["dropped"] < FRAMES
        viewer.wait_until_stopped()
        viewer.say("seek", frame=FRAMES - 2)
        viewer.picture_of(frame=FRAMES - 2)
        assert viewer.state["playing"] is False


@pytest.mark.parametrize("policy", ["skip", "stop"])
def test_damage_is_told_and_playback_goes_on_or_stops(file: Path, tmp_path: Path, policy: str) -> None:
    damaged = damage(file, tmp_path / "damaged.mcap", gop=1)
    with playing(damaged, "--on-error", policy) as running, Viewer(running) as viewer:
        viewer.say("seek", frame=GOP - 1)
        viewer.say("ready")
        viewer.next_picture()
        viewer.say("play", playing=True)
        told = viewer.next_picture().facts
        assert told["damage"]["first"] == GOP
        assert "damaged.mcap" in told["damage"]["message"]
        assert str(tmp_path) not in told["damage"]["message"]
        assert told["damage"]["goes_on_s"] > told["damage"]["time_s"]
        if policy == "skip":
            assert viewer.picture_of(damage=None).facts["frame"] >= 2 * GOP
        else:
            with pytest.raises(TimeoutError):
                viewer.next_picture(2)
            assert viewer.state["playing"] is False


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_twenty_viewers_are_served_without_growth_of_memory(file: Path) -> None:
    with playing(file, "--synthesizer", "linear") as server:
        check_memory(server)


def check_memory(server: Running) -> None:
    rng = random.Random(3)

    def watch() -> None:
        viewers = [Viewer(server) for _ in range(CLIENTS)]
        for viewer in viewers:
            viewer.say("ready")
        for _ in range(4):
            for viewer in viewers:
                viewer.say("move", row=round(rng.uniform(0, 2), 3), col=round(rng.uniform(0, 2), 3))
                viewer.say("seek", frame=rng.randrange(FRAMES))
            for viewer in viewers:
                viewer.next_picture()
        for viewer in viewers:
            viewer.close()

    watch()
    watch()
    before = server.rss_kb()
    for _ in range(4):
        watch()
    # 320 pictures of 115 kB each, decoded sets of 3 MB: anything kept for a viewer would show.
    assert server.rss_kb() - before < 24_000


def test_a_taken_port_and_a_wrong_file_are_told_in_one_line(
    server: Running, file: Path, tmp_path: Path
) -> None:
    common = ("--no-browser", "--synthesizer", "linear")
    assert "in use" in fails(2, "play", file, "--port", str(server.port), *common)
    assert "nothing.mcap" in fails(1, "play", tmp_path / "nothing.mcap", *common)
    assert "--port" in fails(2, "play", file, "--port", "65536", *common)
    assert "synthesizer" in fails(2, "play", file, "--no-browser", "--synthesizer", "none")


def test_an_original_of_another_shape_is_refused(file: Path, tmp_path: Path) -> None:
    other = write_original(tmp_path / "other", (2, 2), frames=1)
    line = fails(1, "play", file, "--original", other, "--no-browser", "--synthesizer", "linear")
    assert "found 2x2 views" in line
    assert "expected 3x3 views" in line


def test_beyond_loopback_it_warns(file: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with playing(file, "--host", "0.0.0.0") as running:
        assert get(running, "/").status == 200
        assert get(running, "/", "evil.example").status == 403
    assert "over the network" in capfd.readouterr().err


def test_without_the_extra_it_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch, file: Path) -> None:
    monkeypatch.setattr(
        "importlib.util.find_spec", lambda name: None if name == "uvicorn" else find_spec(name)
    )
    parser = argparse.ArgumentParser()
    play.add_arguments(parser)
    with pytest.raises(
        MissingExtra,
        match=r"uvicorn is not installed.*pip install 'starlette>=.*' 'uvicorn>=.*' 'websockets>=",
    ):
        play.run(parser.parse_args([str(file)]))


def test_stops_when_told_to(file: Path) -> None:
    with playing(file) as running, Viewer(running) as viewer:
        viewer.say("ready")
        viewer.next_picture()
        running.stop()
        with pytest.raises(ConnectionClosed):
            viewer.take_all()


@pytest.mark.parametrize("everyone", ["0.0.0.0", "::"])
def test_all_addresses_are_announced_by_one_that_others_can_use(everyone: str) -> None:
    address = urlsplit(page_url(everyone, 8123))
    assert address.port == 8123
    assert not ipaddress.ip_address(str(address.hostname)).is_unspecified
    assert page_url("127.0.0.1", 80) == "http://127.0.0.1:80/"
