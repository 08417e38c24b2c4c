"""Plug-ins: specifications with settings, other packages' entry points, and the list of them all."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from coding import encoded_file, frame_set, make_array
from packages import installed

import mvcodec
from mvcodec.cli.plugins import TABLES
from mvcodec.errors import SettingError
from mvcodec.layers.refinement import Refined, matcher_settings, matcher_specification
from mvcodec.stereo.fixed_window import FixedWindow, FixedWindowSettings
from mvcodec.stereo.joint import Joint
from mvcodec.stereo.pairwise import Pairwise
from mvcodec.stereo.sgbm import Sgbm
from mvcodec.synthesis.dils import Dils, DilsSettings
from mvcodec.synthesis.mlvs import Route
from mvcodec.synthesis.synthesizers import SYNTHESIZER_PLUGINS, quicker_synthesizer

ROOT = Path(__file__).parents[1]
EXAMPLE = ROOT / "examples" / "plugin_package"
ARRAY = ROOT / "samples" / "room_2x2"


def test_every_setting_of_dils_is_within_reach() -> None:
    made = mvcodec.make_synthesizer(
        "dils:split=levels,threshold=9,alpha=0.25,fill=no,route=lr,rematch=sad:window=9/median_size=5"
    )
    assert isinstance(made, Dils)
    window = FixedWindow(FixedWindowSettings("sad", window=9, median_size=5, subpixel=True))
    assert made.settings == DilsSettings("levels", 9, 0.25, False, Route.LEFT_RIGHT, window)


def test_a_specified_synthesizer_renders_what_the_object_does() -> None:
    place = mvcodec.Viewpoint(0.5, 0.5)
    settings = DilsSettings(route=Route.LEFT_RIGHT, rematch=Sgbm())
    with mvcodec.open(io.BytesIO(encoded_file(make_array(), 1))) as video:
        named = mvcodec.make_synthesizer("dils:route=lr,rematch=sgbm").render(video[0], place)
        np.testing.assert_array_equal(named.pixels, Dils(settings).render(video[0], place).pixels)
        plain = mvcodec.make_synthesizer("dils").render(video[0], place)
        assert not np.array_equal(named.pixels, plain.pixels)


def test_matchers_take_settings_before_and_behind_a_refinement() -> None:
    plain = mvcodec.make_matcher("joint:subpixel_steps=0,contrast=1e+1")
    assert isinstance(plain, Joint)
    assert (plain.settings.subpixel_steps, plain.settings.contrast) == (0, 10.0)
    refined = mvcodec.make_matcher("ncc:window=5+dlr:erosion_px=3")
    assert isinstance(refined, Refined)
    assert isinstance(refined.matcher, Pairwise)
    assert refined.matcher.pair_matcher == FixedWindow(FixedWindowSettings("ncc", 5, subpixel=True))


@pytest.mark.parametrize(
    ("specification", "message"),
    [
        (
            "dilss",
            "synthesizer: found dilss, expected one of layered, quick, .*; did you mean dils?",
        ),
        ("", "synthesizer: found nothing, expected one of layered"),
        (
            "dils:treshold=3",
            "synthesizer dils: found no setting 'treshold', expected split, threshold",
        ),
        ("dils:treshold=3", r"did you mean threshold\?"),
        ("dils:alpha=2", r"synthesizer dils:alpha: found 2.0, expected a number, 0\.\.1"),
        ("dils:alpha=half", r"synthesizer dils:alpha: found half, expected a number, 0\.\.1"),
        (
            "dils:threshold=1.5",
            "synthesizer dils:threshold: found 1.5, expected a whole number of at least",
        ),
        ("dils:split=level", "synthesizer dils:split: found level, expected runs or levels"),
        ("dils:fill=perhaps", "synthesizer dils:fill: found perhaps, expected yes or no"),
        ("dils:", "synthesizer dils: found '', expected key=value"),
        ("dils:alpha", "synthesizer dils: found 'alpha', expected key=value"),
        ("dils:alpha=0,alpha=1", "synthesizer dils: found 'alpha' twice"),
        (
            "dils:rematch=sadd",
            "synthesizer dils:rematch: found sadd, expected one of joint, .*mean sad?",
        ),
        ("dils:rematch=joint", "synthesizer dils:rematch: found joint, expected one of pairs, such as sgbm"),
        ("quick:a=1", "synthesizer quick: found no setting 'a', expected none: it has no settings"),
    ],
)
def test_a_wrong_specification_says_what_is_wrong_with_it(specification: str, message: str) -> None:
    with pytest.raises(SettingError, match=message):
        mvcodec.make_synthesizer(specification)


@pytest.mark.parametrize(
    ("specification", "message"),
    [
        ("sad:window=8", r"matcher sad:window: found 8, expected an odd number 1\.\.101"),
        ("sgbm:p1=9,p2=9", "sgbm.p1, sgbm.p2: found 9, 9"),
        ("sad+dlx", "matcher refinement: found dlx, expected one of dlr, dlr-thesis; did you mean dlr?"),
        ("sad+dlr:erosion_px=-1", "matcher refinement dlr:erosion_px: found -1"),
    ],
)
def test_a_wrong_matcher_says_what_is_wrong_with_it(specification: str, message: str) -> None:
    with pytest.raises(SettingError, match=message):
        mvcodec.make_matcher(specification)


@pytest.mark.parametrize(
    ("given", "shortest"),
    [
        ("joint", "joint"),
        ("joint:subpixel_steps=2,jump=82", "joint"),
        ("sad:subpixel=on,window=09+dlr:jump_px=1.5", "sad:window=9+dlr"),
        ("sad:subpixel=off", "sad:subpixel=no"),
    ],
)
def test_what_is_recorded_is_the_shortest_specification(given: str, shortest: str) -> None:
    assert matcher_specification(given) == shortest
    assert matcher_settings(given) == matcher_settings(shortest)


def test_a_recorded_synthesizer_makes_the_same_one() -> None:
    chosen = SYNTHESIZER_PLUGINS.choose("dils:rematch=sad:window=9/median_size=5,alpha=0.5,route=lr")
    assert chosen.specification() == "dils:route=lr,rematch=sad:window=9/median_size=5"
    again = SYNTHESIZER_PLUGINS.choose(chosen.specification())
    assert again.make().settings == chosen.make().settings
    assert chosen.all_settings() == {
        "split": "runs",
        "threshold": 20,
        "alpha": 0.5,
        "fill": True,
        "route": "lr",
        "rematch": "sad:window=9/median_size=5",
    }


def test_a_header_names_the_matcher_with_its_settings() -> None:
    array = make_array()
    config = mvcodec.EncoderConfig(
        matcher="sgbm:median_size=3,p1=3", preset="ultrafast", disparity_range_px=(0.0, 8.0)
    )
    with mvcodec.Encoder(array, config) as encoder:
        encoder.push(frame_set(array, 0))
        assert encoder.header is not None
        assert encoder.header.settings["matcher"] == "sgbm:median_size=3"


def test_moving_pictures_are_drawn_with_the_quick_one_whatever_the_settings() -> None:
    assert quicker_synthesizer("layered:spread=0.5") == quicker_synthesizer("layered") == "quick"
    assert quicker_synthesizer("dils:split=levels") is None


def test_every_setting_has_help_and_its_default_is_legal() -> None:
    for table in TABLES:
        for name, plugin in table.own.items():
            assert plugin.help, name
            table.choose(name).make()
            for key, known in plugin.known.items():
                assert known.help, key
                known.check(plugin.default(key))
                if known.parse is None and plugin.default(key) is not None:
                    assert known.read(str(plugin.default(key))) == plugin.default(key)


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The example package and a broken one are installed."""
    folder = tmp_path_factory.mktemp("packages")
    broken = folder / "broken"
    broken.mkdir()
    (broken / "pyproject.toml").write_text(
        '[build-system]\nrequires = ["setuptools"]\nbuild-backend = "setuptools.build_meta"\n'
        '[project]\nname = "mvcodec-broken"\nversion = "0.3"\n'
        '[project.entry-points."mvcodec.matchers"]\nfails = "mvcodec_broken:Nothing"\nsgbm = "a:b"\n'
        "[tool.setuptools]\npy-modules = ['mvcodec_broken']\n"
    )
    (broken / "mvcodec_broken.py").write_text("import a_module_that_is_not_there\n")
    example = folder / "example"
    subprocess.run(["cp", "-r", str(EXAMPLE), str(example)], check=True)
    return installed(folder / "site", example, broken)


def run(environment: dict[str, str], *arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "mvcodec", *map(str, arguments)]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def test_another_packages_plugins_are_listed_with_their_source(environment: dict[str, str]) -> None:
    done = run(environment, "plugins", "--json")
    listed = {(found["kind"], found["name"]): found for found in json.loads(done.stdout)}
    blocks = listed["matcher", "blocks"]
    assert blocks["source"] == "mvcodec-example 1.0"
    assert blocks["settings"] == [
        {
            "name": "size",
            "type": "int",
            "default": 8,
            "allowed": "a whole number, 2..64",
            "help": "side of a block, px",
        }
    ]
    assert listed["synthesizer", "nearest"]["settings"] == []
    assert listed["synthesizer", "dils"]["source"] == "mvcodec"


def test_another_packages_matcher_encodes_and_its_synthesizer_renders(
    environment: dict[str, str], tmp_path: Path
) -> None:
    file, views = tmp_path / "x.mcap", tmp_path / "views"
    encoded = run(
        environment,
        "encode",
        ROOT / "samples" / "room_2x2",
        file,
        "--matcher",
        "blocks:size=16",
        "--frames",
        ":1",
    )
    assert encoded.returncode == 0, encoded.stderr
    assert mvcodec.read_info(file).header.settings["matcher"] == "blocks:size=16"
    done = run(environment, "decode", file, views, "--view", "0.4,0.4", "--synthesizer", "nearest")
    assert done.returncode == 0, done.stderr


def test_a_broken_entry_point_is_one_line_that_names_its_package(
    environment: dict[str, str], tmp_path: Path
) -> None:
    done = run(
        environment, "encode", ROOT / "samples" / "room_2x2", tmp_path / "x.mcap", "--matcher", "fails"
    )
    (line,) = done.stderr.splitlines()
    assert done.returncode == 1
    assert line.startswith(
        "mvcodec: error: mvcodec-broken 0.3: found the entry point fails = mvcodec_broken:"
    )
    assert "No module named 'a_module_that_is_not_there'" in line
    listed = run(environment, "plugins")
    assert listed.returncode == 0
    assert "mvcodec-broken 0.3" in listed.stderr
    assert "its matcher sgbm is ignored" in listed.stderr
    assert "Traceback" not in listed.stderr


def test_one_plugin_is_shown_with_settings_or_told_to_be_unknown() -> None:
    shown = run(dict(os.environ), "plugins", "sad")
    assert "window=21\n      side of the square window, px; an odd number 1..101" in shown.stdout
    wrong = run(dict(os.environ), "plugins", "dilss")
    assert wrong.returncode == 2
    assert wrong.stderr.strip().endswith("did you mean dils?")
