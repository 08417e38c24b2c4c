"""Settings of the joint matcher, and of its quicker kin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mvcodec.errors import SettingError
from mvcodec.settings import check_settings, setting
from mvcodec.stereo.scanlines import MAX_SUM, Penalties

FEW_LEVELS = 24
"""Disparities that the whole of `blind_cost` is for."""


@dataclass(frozen=True, slots=True)
class JointSettings:
    """Settings of the joint matcher. Costs of matching are in units of two 8-bit grey levels.

    Raises:
        SettingError: a setting is outside its range, or costs and penalties together exceed 8 bits.
    """

    colour_limit: int = setting(30, "most that the colour difference counts", low=0, high=60)
    census_x: int = setting(4, "half the census window's width, px", low=1, high=7)
    census_y: int = setting(3, "half the census window's height, px", low=1, high=7)
    bit_cost: int = setting(2, "cost of each bit of census distance", low=0, high=60)
    most_bits: int = setting(21, "bits that count at most", low=0, high=64)
    lone_cost: int = setting(12, "added where one partner alone must see the pixel", low=0, high=50)
    blind_cost: int = setting(
        40,
        "added to partners in whose direction a picture has no detail, while it has across; less where many"
        " disparities are possible",
        low=0,
        high=100,
    )
    outside_cost: int = setting(50, "of a disparity that leaves every partner's picture", low=0, high=127)
    small_step: int = setting(17, "penalty P1 of semi-global matching", low=0, high=100)
    jump: int = setting(82, "penalty P2 of semi-global matching", low=0, high=150)
    least_jump: int = setting(25, "what is left of P2 at an edge of the picture", low=0, high=150)
    contrast: float = setting(8, "grey levels that halve P2", low=1e-3, high=255)
    diagonals: bool = setting(True, "paths run along diagonals too")
    self_check: bool = setting(
        False, "a camera's own costs say what its partners see, whose maps are not needed then"
    )
    completion: bool = setting(
        True, "decide again what is not confirmed by what is around; else it is filled along rows"
    )
    completion_small_step: int = setting(20, "P1 of that", low=0, high=100)
    completion_jump: int = setting(80, "P2 of that", low=0, high=150)
    completion_least_jump: int = setting(7, "what is left of it at an edge", low=0, high=150)
    hold_per_px: float = setting(
        7, "how firmly confirmed pixels hold meanwhile, for each px", low=0, high=1e3
    )
    hold_limit: int = setting(40, "the most that counts of it", low=0, high=127)
    through_cost: int = setting(40, "of a disparity that another camera sees through", low=0, high=127)
    beyond_partners: bool = setting(True, "carry surfaces on to where no partner sees")
    edge_cost: float = setting(
        3, "px of detour there that a grey level of contrast is worth", low=0, high=1e6
    )
    # What stands in the world lies on floors and tables, whose disparity is the same along rows.
    row_cost: float = setting(50, "px of detour there that a step to the next row is worth", low=1, high=1e6)
    tolerance_px: float = setting(1.0, "maps agree within this, px", low=1e-3, high=255)
    border_speckle_px: int = setting(
        50, "smallest patch that counts where no partner sees the whole range, pixels", low=0, high=1e6
    )
    median_size: int = setting(5, "window of the median after completion, px; 0: none", choices=(0, 3, 5))
    thin_px: float = setting(
        3,
        "the median leaves confirmed surfaces alone that are nearer by more than this than all that it leaves"
        " around them, px",
        low=0,
        high=1e6,
    )
    thin_area_px: int = setting(16, "and that have at least this many pixels", low=0, high=1e6)
    plain_levels: int = setting(
        7,
        "surfaces take over a pixel of ground beside them that varies by less, where their edge moves with"
        " them, grey levels; 0: none",
        low=0,
        high=255,
    )
    speck_area_px: int = setting(
        30,
        "smaller pieces that contradict all around them give way to that, pixels; 1: none",
        low=1,
        high=1000,
    )
    subpixel_steps: int = setting(2, "steps of sub-pixel refinement", low=0, high=20)
    search_share: float = setting(
        0,
        "largest share of a picture that is searched at full size, where maps of small copies are in doubt",
        low=0,
        high=1,
    )
    full_size_steps: int = setting(
        0,
        "steps of it after maps of small copies were brought back; surfaces reach further after these then",
        low=0,
        high=20,
    )

    def __post_init__(self) -> None:
        check_settings(self, "JointSettings.")
        match = self.colour_limit + self.bit_cost * self.most_bits
        dearest = max(match + self.lone_cost + self.blind_cost, self.outside_cost)
        room = MAX_SUM - max(self.jump, self.least_jump) - self.small_step
        if dearest > room:
            raise SettingError("JointSettings, the highest cost", dearest, f"at most {room}")

    def blind_cost_within(self, range_px: tuple[float, float]) -> int:
        """What `blind_cost` comes to in a search of this many px.

        The partner across an edge is hidden beside it. Where it is, each further disparity is a further
        chance of a match by accident, which must not outvote the blind partner that sees the pixel.
        """
        levels = range_px[1] - range_px[0] + 1
        return round(self.blind_cost * min(1.0, FEW_LEVELS / levels) ** 2)

    @property
    def matching_penalties(self) -> Penalties:
        """Of the match itself."""
        return Penalties(self.small_step, self.jump, self.least_jump, self.contrast, self.diagonals)

    @property
    def completion_penalties(self) -> Penalties:
        """Of what completes it."""
        steps = self.completion_small_step, self.completion_jump, self.completion_least_jump
        return Penalties(*steps, self.contrast, self.diagonals)


SMALL_CENSUS: dict[str, Any] = {
    "census_x": 2,
    "census_y": 2,
    "bit_cost": 4,
    "most_bits": 10,
    "small_step": 18,
    "jump": 85,
}

BALANCED: dict[str, Any] = {
    **SMALL_CENSUS,
    "median_size": 3,
    "search_share": 0.15,
    "subpixel_steps": 0,
    "full_size_steps": 1,
}
"""Of what is matched in small copies (`mvcodec.stereo.realtime`)."""

REALTIME: dict[str, Any] = {
    **SMALL_CENSUS,
    "diagonals": False,
    "completion": False,
    "self_check": True,
    "blind_cost": 0,
    "beyond_partners": False,
    "plain_levels": 0,
    "subpixel_steps": 0,
}
"""Of the same in real time."""

SMALL_PICTURES: dict[str, Any] = {
    "completion": True,
    "beyond_partners": True,
    "plain_levels": 7,
    "median_size": 5,
    "search_share": 0.0,
    "full_size_steps": 0,
}
"""What pictures that are too small to be shrunk have time for in real time."""
