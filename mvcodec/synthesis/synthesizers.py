"""The synthesizers by name. Importing this does not import Numba: kernels load at the first view."""

from __future__ import annotations

from collections.abc import Callable

from mvcodec.errors import SettingError
from mvcodec.synthesis.dils import Dils
from mvcodec.synthesis.layered import Layered
from mvcodec.synthesis.linear import Linear
from mvcodec.synthesis.quick import Quick
from mvcodec.synthesis.synthesizer import Synthesizer

SYNTHESIZERS: dict[str, Callable[[], Synthesizer]] = {
    "layered": Layered,
    "quick": Quick,
    "dils": Dils,
    "linear": Linear,
}

DEFAULT_SYNTHESIZER = "layered"

QUICKER = {"layered": "quick"}
"""What stands in for a synthesizer where it would be too slow, as while the viewpoint moves."""


def make_synthesizer(name: str) -> Synthesizer:
    """The synthesizer of this name.

    Raises:
        SettingError: there is none; the message names the choices.
    """
    if name not in SYNTHESIZERS:
        raise SettingError("synthesizer", name, f"one of {', '.join(SYNTHESIZERS)}")
    return SYNTHESIZERS[name]()
