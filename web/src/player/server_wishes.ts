/** What a server is asked to show, as it repeats it with the picture that shows it. */

import type { Facts } from "./server_connection.ts";
import { placed, type Shown } from "./shown.ts";

export interface Asked {
  readonly row: number;
  readonly col: number;
  readonly look: string;
  readonly eyes: string;
  readonly steps: number;
  readonly focus: number | null;
  /** Share of the farthest. */
  readonly dolly: number;
  readonly wipe: number;
}

/** `mostDolly`: the farthest that `Shown.dolly` may be. */
export function asAsked(shown: Shown, cols: number, mostDolly: number): Asked {
  const { view, look, eyes, focus, dolly, wipe } = placed(shown);
  return {
    row: view.row, col: view.col, look, eyes: eyes.mode, wipe, focus: focus ?? null,
    steps: eyes.mode === "one" ? 0 : Math.min(Math.max(eyes.distance, 0), cols - 1),
    dolly: Math.min(dolly / mostDolly, 1),
  };
}

/** The same for what is the same. */
export function keyOf({ row, col, look, eyes, steps, focus, dolly, wipe }: Asked): string {
  const isAhead = look !== "disagreement" && dolly > 0; // cameras are compared in their own plane
  return JSON.stringify([row, col, look, eyes, steps, focus, isAhead ? dolly : 0, wipe]);
}

export function keyOfFacts({ row, col, look, eyes, eye_steps, focus_px, dolly, wipe }: Facts): string {
  return keyOf({ row, col, look, eyes, steps: eye_steps, focus: focus_px, dolly, wipe });
}
