/** Where a viewer's eyes are in the array: metres of the room -> steps of the array. */

import type { Header } from "../container/header.ts";
import { cellRho, clampView, steps, type Viewpoint } from "../geometry.ts";

/** A place in the room, m: x to the right, y up. */
export interface Point {
  readonly x: number;
  readonly y: number;
}

/** Most parallax between both eyes, as a share of the picture's width, and most cells between them. */
const MOST_PARALLAX = 0.03;
const MOST_CELLS = 0.5;

/** Cells between both eyes: half a cell, or less where the nearest and the farthest would part by more than 3 % of the width. */
export function eyeCells(header: Header): number {
  const [far, near] = header.range;
  return Math.min(MOST_CELLS, (MOST_PARALLAX * header.width) / Math.max(near - far, 1e-3));
}

/**
 * The eyes' viewpoints, when the head's first place saw `home`.
 *
 * Both are kept inside the array together, so that they stay apart at its border.
 */
export function viewsOf(header: Header, home: Viewpoint, first: Point, eyes: readonly Point[], cellsPerMetre: number): Viewpoint[] {
  const step = steps(header);
  const wanted = eyes.map(({ x, y }) => ({
    row: home.row - (cellsPerMetre * step.row * (y - first.y)) / cellRho(header),
    col: home.col + cellsPerMetre * step.col * (x - first.x),
  }));
  const down = inward(wanted.map(({ row }) => row), header.rows - 1);
  const across = inward(wanted.map(({ col }) => col), header.cols - 1);
  return wanted.map(({ row, col }) => clampView(header, { row: row + down, col: col + across }));
}

/** By how much places have to move to lie within 0 and `most`. */
function inward(places: readonly number[], most: number): number {
  return Math.max(0, -Math.min(...places)) - Math.max(0, Math.max(...places) - most);
}
