"""What quality is asked for: the setting `target_psnr`."""

from __future__ import annotations

from dataclasses import dataclass

from mvcodec.settings import check_settings, setting

PROBED_SETS = 2
"""Frame sets that are coded, from the middle of the input on: a keyframe, and what is like all others."""


@dataclass(frozen=True, slots=True)
class QualityTarget:
    """The quality that a coding should reach.

    Raises:
        SettingError: no such quality.
    """

    target_psnr: float | None = setting(
        None,
        "the largest QP whose mean luma PSNR over all views of the grid is this or more, dB, measured on"
        f" {PROBED_SETS} frame sets from the middle of the input, which must have the originals of all views;"
        " beside enhance auto: the quantisers of pictures and layer that reach it with the fewest bits",
        low=1,
        high=100,
    )

    def __post_init__(self) -> None:
        check_settings(self)
