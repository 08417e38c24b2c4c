/** One picture of the screen: one view, or two for both eyes. */

import type { Header } from "../container/header.ts";
import { clampView, convergence, steps, type Viewpoint } from "../geometry.ts";
import type { CameraFrame } from "../synthesis/camera_textures.ts";
import type { ViewRenderer } from "../synthesis/renderer.ts";
import type { Shown } from "./shown.ts";

export const EYE_MODES = ["one", "side by side", "anaglyph"] as const;

/** Whether both eyes get a picture of their own, and how far apart they are, in steps of the array. */
export interface Eyes {
  readonly mode: (typeof EYE_MODES)[number];
  readonly distance: number;
}

/** Where the two eyes are: `distance` steps apart around a viewpoint, kept inside. */
export function eyesOf(header: Header, view: Viewpoint, distance: number): [Viewpoint, Viewpoint] {
  const half = Math.min(distance, header.cols - 1) / 2;
  const middle = Math.min(Math.max(view.col, half), header.cols - 1 - half);
  return [clampView(header, { row: view.row, col: middle - half }), clampView(header, { row: view.row, col: middle + half })];
}

/** Viewpoints each way over which a picture with a focus is averaged, and how far they reach, in cells. */
const APERTURE = 4;
const APERTURE_CELLS = 0.3;

/** The viewpoints of a wide lens around one, within the cell's reach, and how much each moves a px of disparity. */
export function apertureOf(header: Header, view: Viewpoint): { view: Viewpoint; moves: readonly [number, number] }[] {
  const step = steps(header);
  const spread = (size: number) =>
    size === 0 ? [0] : Array.from({ length: APERTURE }, (_, i) => ((i + 0.5) / APERTURE - 0.5) * APERTURE_CELLS * size);
  return spread(step.row).flatMap((down) =>
    spread(step.col).map((across) => {
      const there = clampView(header, { row: view.row + down, col: view.col + across });
      return { view: there, moves: convergence(header, view, there, 1) };
    }),
  );
}

/** The views that `drawShown` draws. */
export function viewsShown(header: Header, { view, eyes, focus }: Shown): Viewpoint[] {
  if (focus !== undefined) return apertureOf(header, view).map((one) => one.view);
  return eyes.mode === "one" ? [view] : eyesOf(header, view, eyes.distance);
}

/** Draw what is to be shown on the canvas, with a share of the picture's size each way. */
export function drawShown(
  renderer: ViewRenderer, canvas: HTMLCanvasElement, header: Header,
  frames: readonly CameraFrame[], shown: Shown, detail: number, fine: boolean,
): void {
  const width = Math.max(Math.round(header.width * detail), 1);
  const height = Math.max(Math.round(header.height * detail), 1);
  const isWide = shown.eyes.mode === "side by side";
  if (canvas.width !== width * (isWide ? 2 : 1) || canvas.height !== height) {
    canvas.width = width * (isWide ? 2 : 1);
    canvas.height = height;
  }
  const settings = { look: shown.look, fine, dolly: shown.dolly, wipe: shown.wipe };
  const area = { x: 0, y: 0, width, height };
  const { focus } = shown;
  if (focus !== undefined) {
    apertureOf(header, shown.view).forEach(({ view, moves }, i) => {
      const offset = [moves[0] * focus, moves[1] * focus] as const;
      renderer.draw(frames, view, { ...settings, fine: false, offset, share: 1 / (i + 1) }, area, null);
    });
    return;
  }
  if (shown.eyes.mode === "one") {
    renderer.draw(frames, shown.view, settings, area, null);
    return;
  }
  const eyes = eyesOf(header, shown.view, shown.eyes.distance);
  eyes.forEach((eye, i) => {
    const mask = [i === 0, i === 1, i === 1] as const; // red for the left eye, cyan for the right one
    if (isWide) renderer.draw(frames, eye, settings, { ...area, x: i * width }, null);
    else renderer.draw(frames, eye, { ...settings, mask }, area, null);
  });
}
