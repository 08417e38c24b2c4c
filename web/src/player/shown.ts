/** What is asked of the player to show. */

import type { Viewpoint } from "../geometry.ts";
import type { Look } from "../synthesis/renderer.ts";
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
