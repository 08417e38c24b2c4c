/** What is asked of the player to show, and what is told of it. */

import type { Viewpoint } from "../geometry.ts";
import type { Look } from "../synthesis/looks.ts";
import type { Eyes } from "./drawing.ts";

export interface Shown {
  frame: number;
  view: Viewpoint;
  look: Look;
  /** See `ViewSettings.dolly`. */
  dolly: number;
  eyes: Eyes;
  /** See `ViewSettings.wipe`. */
  wipe: number;
  /** Disparity that is in focus, px; undefined: everything is. */
  focus: number | undefined;
}

export function shownFirst(): Shown {
  return { frame: 0, view: { row: 0, col: 0 }, look: "picture", dolly: 0, eyes: { mode: "one", distance: 0.5 }, wipe: 0, focus: undefined };
}

/** What is really shown: originals are of places of the array, so what is compared with one is one sharp view from the nearest of those. */
export function placed(shown: Shown): Shown {
  if (shown.look !== "difference") return shown;
  const view = { row: Math.round(shown.view.row), col: Math.round(shown.view.col) };
  return { ...shown, view, dolly: 0, eyes: { ...shown.eyes, mode: "one" }, focus: undefined };
}

/** Where a file is shown first, and what it is compared with. */
export interface Opening {
  readonly seconds?: number;
  /** The array's middle where absent. */
  readonly view?: Viewpoint | undefined;
  /** See `Originals`. */
  readonly originals?: string | undefined;
}
