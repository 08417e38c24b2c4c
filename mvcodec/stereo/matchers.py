"""The matchers by name."""

from __future__ import annotations

from typing import cast

from mvcodec.errors import SettingError
from mvcodec.plugin_tables import Plugin, PluginTable
from mvcodec.stereo.adcensus import AdCensus, AdCensusSettings
from mvcodec.stereo.fixed_window import FixedWindow, FixedWindowSettings
from mvcodec.stereo.given import Given, GivenSettings
from mvcodec.stereo.joint import Joint
from mvcodec.stereo.joint_settings import BALANCED, REALTIME, JointSettings
from mvcodec.stereo.matcher import Matcher, PairMatcher
from mvcodec.stereo.pairwise import Pairwise
from mvcodec.stereo.realtime import Realtime
from mvcodec.stereo.sgbm import Sgbm, SgbmSettings


def _fixed_window(measure: str, title: str, window: int = 9) -> Plugin:
    defaults = {"measure": measure, "window": window, "subpixel": True}
    text = f"fixed windows by {title}, winner takes all, to parts of a pixel"
    return Plugin(lambda made: Pairwise(FixedWindow(made)), FixedWindowSettings, text, defaults)


MATCHERS: dict[str, Plugin] = {
    "joint": Plugin(Joint, JointSettings, "each camera against all its neighbours at once; the default"),
    "balanced": Plugin(Realtime, JointSettings, "the same of small copies: several times as fast", BALANCED),
    "realtime": Plugin(
        Realtime, JointSettings, "that with less in it, and only of cameras whose map is sent", REALTIME
    ),
    "sgbm": Plugin(
        lambda made: Pairwise(Sgbm(made)), SgbmSettings, "semi-global matching of pairs, by OpenCV"
    ),
    # Plain maps to judge renderers by: one partner.
    "sgbm-h": Plugin(
        lambda made: Pairwise(Sgbm(made), vertical=False), SgbmSettings, "the same along rows alone"
    ),
    "sad": _fixed_window("sad", "absolute differences", 21),
    "ssd": _fixed_window("ssd", "squared differences"),
    "ncc": _fixed_window("ncc", "normalised cross correlation"),
    "census": _fixed_window("census", "Hamming distances of census transforms"),
    "adcensus": Plugin(
        lambda made: Pairwise(AdCensus(made)), AdCensusSettings, "AD-Census (Mei et al. 2011) of pairs"
    ),
    "given": Plugin(Given, GivenSettings, "no matching: disparity or depth that the input already has"),
}

MATCHER_PLUGINS = PluginTable("matcher", MATCHERS, "mvcodec.matchers")


def make_base_matcher(specification: str) -> Matcher:
    """The matcher of that name and settings, without a refinement.

    Raises:
        SettingError: there is none, or a setting is unknown or outside its range.
        InputError: another package's matcher does not load.
    """
    made = MATCHER_PLUGINS.choose(specification).make()
    return cast("Matcher", made) if hasattr(made, "match") else Pairwise(made)


def make_pair_matcher(specification: str) -> PairMatcher:
    """The same for a pair of pictures.

    Raises:
        SettingError: as above, or it is one of whole arrays.
        InputError: as above.
    """
    matcher = make_base_matcher(specification)
    if not isinstance(matcher, Pairwise):
        raise SettingError("matcher", specification, "one of pairs, such as sgbm, sad or adcensus")
    return matcher.pair_matcher
