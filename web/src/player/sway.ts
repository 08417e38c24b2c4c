/** A gentle sway that shows that the picture has depth, until somebody touches the player. */

import type { Viewpoint } from "../geometry.ts";

/** Share of the array's width and height that it sways over, to each side. */
const REACH = 0.16;
const PERIOD_S = 7;

/** The view of a sway at some ms after its start, around the array's middle. */
export function swayAt(rows: number, cols: number, ms: number): Viewpoint {
  const turn = (2 * Math.PI * ms) / (1000 * PERIOD_S);
  const across = Math.sin(turn) * REACH * (cols - 1);
  const down = (1 - Math.cos(turn)) * 0.5 * REACH * (rows - 1);
  return { row: (rows - 1) / 2 + (cols > 1 ? down : Math.sin(turn) * REACH * (rows - 1)), col: (cols - 1) / 2 + across };
}
