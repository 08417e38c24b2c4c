"""The matchers by name."""

from __future__ import annotations

from collections.abc import Callable

from mvcodec.errors import SettingError
from mvcodec.stereo.adcensus import AdCensus
from mvcodec.stereo.fixed_window import FixedWindow, FixedWindowSettings
from mvcodec.stereo.joint import Joint
from mvcodec.stereo.matcher import Matcher
from mvcodec.stereo.pairwise import Pairwise
from mvcodec.stereo.sgbm import Sgbm

MATCHERS: dict[str, Callable[[], Matcher]] = {
    "joint": Joint,
    "sgbm": lambda: Pairwise(Sgbm()),
    # Plain maps to judge renderers by: one partner.
    "sgbm-h": lambda: Pairwise(Sgbm(), vertical=False),
    "sad": lambda: Pairwise(FixedWindow(FixedWindowSettings("sad", subpixel=True))),
    "ssd": lambda: Pairwise(FixedWindow(FixedWindowSettings("ssd", window=9, subpixel=True))),
    "ncc": lambda: Pairwise(FixedWindow(FixedWindowSettings("ncc", window=9, subpixel=True))),
    "census": lambda: Pairwise(FixedWindow(FixedWindowSettings("census", window=9, subpixel=True))),
    "adcensus": lambda: Pairwise(AdCensus()),
}


def make_base_matcher(name: str) -> Matcher:
    """The matcher of that name, without a refinement.

    Raises:
        SettingError: there is none.
    """
    if name not in MATCHERS:
        raise SettingError("matcher", name, "one of " + ", ".join(MATCHERS))
    return MATCHERS[name]()
