/** One picture of the screen: one view, or two for both eyes. */

import type { Header } from "../container/header.ts";
import { clampView, convergence, steps, type Viewpoint } from "../geometry.ts";
import type { CameraFrame } from "../synthesis/camera_textures.ts";
import { isDrafted } from "../synthesis/draft.ts";
import type { ViewRenderer } from "../synthesis/renderer.ts";
import type { Shown } from "./shown.ts";

export const EYE_MODES = ["one", "side by side", "anaglyph", "nine"] as const;

/** Whether both eyes get a picture of their own (or nine views, as lenticular displays take them), and how far apart they are, in steps of the array. */
export interface Eyes {
  readonly mode: (typeof EYE_MODES)[number];
  readonly distance: number;
}

/** Most px that nine pictures have together. */
const NINE_SIZE = [1920, 1280] as const;

/** Where the eyes are: `distance` steps apart around a viewpoint, leftmost first, kept inside together. */
export function eyesOf(header: Header, view: Viewpoint, { mode, distance }: Eyes): Viewpoint[] {
  if (mode === "one") return [view];
  const count = mode === "nine" ? 9 : 2;
  const width = Math.min(distance * (count - 1), header.cols - 1);
  const left = Math.min(Math.max(view.col - width / 2, 0), header.cols - 1 - width);
  return Array.from({ length: count }, (_, i) => clampView(header, { row: view.row, col: left + (i * width) / (count - 1) }));
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
  return eyesOf(header, view, eyes);
}

/** One view, which a draft can show without any help of shaders. */
export function isPlain({ look, eyes, focus }: Shown): boolean {
  return isDrafted(look) && eyes.mode === "one" && focus === undefined;
}

/** A share of the picture's size each way, px. */
export function sizeOf({ width, height }: Header, share: number): [number, number] {
  return [Math.max(Math.round(width * share), 1), Math.max(Math.round(height * share), 1)];
}

/** Draw what is to be shown on the canvas, with a share of the picture's size each way. */
export function drawShown(
  renderer: ViewRenderer, canvas: HTMLCanvasElement, header: Header,
  frames: readonly CameraFrame[], shown: Shown, detail: number, fine: boolean,
): void {
  const { mode } = shown.eyes;
  const [across, down] = mode === "nine" ? [3, 3] : mode === "side by side" ? [2, 1] : [1, 1];
  const scale = mode === "nine" ? Math.min(detail, NINE_SIZE[0] / (3 * header.width), NINE_SIZE[1] / (3 * header.height)) : detail;
  const [width, height] = sizeOf(header, scale);
  if (canvas.width !== width * across || canvas.height !== height * down) {
    canvas.width = width * across;
    canvas.height = height * down;
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
  eyesOf(header, shown.view, shown.eyes).forEach((eye, i) => {
    const place = { ...area, x: (i % across) * width, y: (down - 1 - Math.floor(i / across)) * height };
    const mask = [i === 0, i === 1, i === 1] as const; // red for the left eye, cyan for the right one
    if (mode === "anaglyph") renderer.draw(frames, eye, { ...settings, mask }, area, null);
    else renderer.draw(frames, eye, settings, place, null);
  });
}
