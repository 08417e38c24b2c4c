"""Which rows and columns tables 6.5 - 6.10 score, and where the thesis's figures of them are."""

from __future__ import annotations

from dataclasses import dataclass

from mvcodec.array import Position
from mvcodec.synthesis.mlvs import Route
from thesis.thesis_figures import ThesisTables

SPANS = {"1-to-5": 4, "1-to-9": 8, "1-to-17": 16}
"""Grid steps between the cameras of a cell, by the thesis's name."""

BETAS = (0.25, 0.5, 0.75)


@dataclass(frozen=True, slots=True)
class Line:
    """A row (levels 1 and 3) or column (level 2) of the grid.

    Attributes:
        span: a name of SPANS.
        level: of MLVS.
        number: of the row or column, counted from 1 as the thesis does.
        table: the thesis's, or None where it has none.
        ssim, psnr, ssim_with_holes: its entries, where there are; its PSNR is psnr_saturated.
    """

    span: str
    level: int
    number: int
    table: str | None = None
    ssim: str | None = None
    psnr: str | None = None
    ssim_with_holes: str | None = None

    @property
    def name(self) -> str:
        """As printed."""
        return f"{'column' if self.level == 2 else 'row'} {self.number}"

    @property
    def top(self) -> int:
        """First row of the cell that the line crosses, counted from 0."""
        if self.level == 2:
            return 0
        return max(self.number - 2, 0) // SPANS[self.span] * SPANS[self.span]

    @property
    def routes(self) -> tuple[Route | None, ...]:
        """Ways to it; there is but one to levels 1 and 2."""
        return tuple(Route) if self.level == 3 else (None,)

    def thesis(self, tables: ThesisTables, entry: str | None, beta: float) -> float | None:
        """The thesis's figure at beta, or None where it has none."""
        if self.table is None or entry is None or beta not in THESIS_BETAS[self.span]:
            return None
        return float(tables.at(self.table, entry, THESIS_BETAS[self.span].index(beta)))

    def place(self, beta: float) -> Position:
        """The view at beta, in its cell."""
        between = round(beta * SPANS[self.span])
        return (between, self.number - 1) if self.level == 2 else (self.number - 1 - self.top, between)


LINES = (
    Line(
        "1-to-5",
        1,
        1,
        "table_6_5_lego_level1_1to5",
        "row1_ssim",
        "row1_psnr",
        "row1_ssim_without_filling",
    ),
    Line("1-to-5", 2, 1, "table_6_6_lego_level2_1to5", "col1_ssim", "col1_psnr"),
    Line("1-to-5", 3, 7, "table_6_7_lego_level3_1to5", "row7_ssim"),
    Line("1-to-5", 3, 11, "table_6_7_lego_level3_1to5", "row11_ssim"),
    Line("1-to-9", 1, 1, "table_6_8_lego_1to9_level1_ssim", "row1"),
    Line("1-to-9", 1, 9, "table_6_8_lego_1to9_level1_ssim", "row9"),
    Line("1-to-9", 2, 1, "table_6_9_lego_1to9_level2_ssim", "col1"),
    Line("1-to-9", 3, 7, "table_6_10_lego_1to9_level3_ssim", "row7"),
    Line("1-to-9", 3, 11, "table_6_10_lego_1to9_level3_ssim", "row11"),
    Line("1-to-17", 1, 1),
    Line("1-to-17", 2, 1),
    Line("1-to-17", 3, 9),
)

THESIS_BETAS = {"1-to-5": (0.25, 0.5, 0.75), "1-to-9": (0.25, 0.75)}
"""Of the items of the thesis's entries; the third one of 1-to-9 is of row or column 9: a camera."""
