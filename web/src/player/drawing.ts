/** One picture of the screen: one view, or two for both eyes. */

import type { Header } from "../container/header.ts";
import { clampView, type Viewpoint } from "../geometry.ts";
import type { CameraFrame } from "../synthesis/camera_textures.ts";
import type { ViewRenderer } from "../synthesis/renderer.ts";
import type { Shown } from "./engine.ts";

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
  const settings = { look: shown.look, fine, dolly: shown.dolly };
  const area = { x: 0, y: 0, width, height };
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
