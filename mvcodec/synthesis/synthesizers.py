"""The synthesizers by name. Importing this does not import Numba: kernels load at the first view."""

from __future__ import annotations

from typing import cast

from mvcodec.plugin_tables import Plugin, PluginTable
from mvcodec.synthesis.dils import Dils, DilsSettings
from mvcodec.synthesis.layered import Layered, LayeredSettings
from mvcodec.synthesis.linear import Linear, LinearSettings
from mvcodec.synthesis.quick import Quick
from mvcodec.synthesis.synthesizer import Synthesizer

SYNTHESIZERS: dict[str, Plugin] = {
    "layered": Plugin(Layered, LayeredSettings, "all cameras of the cell, depth-ordered; the default"),
    "quick": Plugin(Quick, None, "the same geometry at a third of the cost, for pictures that move"),
    "dils": Plugin(Dils, DilsSettings, "depth image layers separation, as the thesis has it"),
    "linear": Plugin(Linear, LinearSettings, "linear interpolation between two views: the thesis's baseline"),
}

SYNTHESIZER_PLUGINS = PluginTable("synthesizer", SYNTHESIZERS, "mvcodec.synthesizers")

DEFAULT_SYNTHESIZER = "layered"

QUICKER = {"layered": "quick"}
"""What stands in for a synthesizer where it would be too slow, as while the viewpoint moves."""


def make_synthesizer(specification: str) -> Synthesizer:
    """The synthesizer of this name and settings: ``layered``, or ``dils:split=levels,alpha=0.5``.

    Raises:
        SettingError: there is none, or a setting is unknown or outside its range; names the choices.
        InputError: another package's synthesizer does not load; names the package.
    """
    return cast("Synthesizer", SYNTHESIZER_PLUGINS.choose(specification).make())


def quicker_synthesizer(specification: str) -> str | None:
    """What stands in for a synthesizer while pictures move; None where it does that itself."""
    return QUICKER.get(specification.partition(":")[0])
