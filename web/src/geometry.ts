/** The camera array: its real cameras, the cells between them, and where pixels move (FORMAT.md, geometry). */

import type { Header } from "./container/header.ts";

/** A real camera's place on the dense grid. */
export interface Camera {
  readonly row: number;
  readonly col: number;
}

/** A place on the plane of the cameras, in steps of the dense grid; fractions are legal. */
export interface Viewpoint {
  readonly row: number;
  readonly col: number;
}

/** A real camera as a view sees it. */
export interface Contributor {
  readonly camera: Camera;
  /** px (x, y) from the view to the camera for each px of disparity. */
  readonly shift: readonly [number, number];
  /** How much it counts, above 0. */
  readonly weight: number;
}

/** Squared cells: a camera at distance b counts 1 / (SPREAD + b^2). */
export const SPREAD = 0.4;

/** Cells over which a camera fades out before a border that it does not stand on. */
const FADE = 0.25;

export function cameras(header: Header): Camera[] {
  return header.realRows.flatMap((row) => header.realCols.map((col) => ({ row, col })));
}

/** Grid steps between neighbouring real rows and columns; 0 where there is one only. */
export function steps(header: Header): { row: number; col: number } {
  const step = (places: readonly number[]) => (places.length > 1 ? places[1] - places[0] : 0);
  return { row: step(header.realRows), col: step(header.realCols) };
}

/** R of FORMAT.md: px of vertical shift for each px of disparity across one cell. */
export function cellRho(header: Header): number {
  const step = steps(header);
  return step.row && step.col ? (header.rho * step.row) / step.col : 1;
}

/** Whether a real camera's pictures are coded without those of others. */
export function playsAlone(header: Header, camera: Camera): boolean {
  return !header.predicted.some(([row, col]) => row === camera.row && col === camera.col);
}

/** Whether there are views between the cameras: with maps, and where the pictures of all cameras can be decoded. */
export function isSynthesised(header: Header): boolean {
  return header.mapCameras !== "none" && header.predicted.length === 0;
}

/** The nearest viewpoint that can be shown: between the outermost cameras, or a camera's own where nothing lies between. */
export function clampView(header: Header, view: Viewpoint): Viewpoint {
  const clamp = (value: number, most: number) => (Number.isFinite(value) ? Math.min(Math.max(value, 0), most) : 0);
  const inside = { row: clamp(view.row, header.rows - 1), col: clamp(view.col, header.cols - 1) };
  return isSynthesised(header) ? inside : nearestCamera(header, inside);
}

/** What a pixel moves for each px of disparity, from a view to a camera. */
export function shiftTo(header: Header, view: Viewpoint, camera: Camera): [number, number] {
  const step = steps(header);
  const across = step.col ? (view.col - camera.col) / step.col : 0;
  const down = step.row ? (view.row - camera.row) / step.row : 0;
  return [across, cellRho(header) * down];
}

/** px (x, y) that a view is moved by so that points of a disparity lie where another view has them. */
export function convergence(header: Header, home: Viewpoint, view: Viewpoint, disparity: number): [number, number] {
  const [across, down] = shiftTo(header, home, view);
  return [disparity * across, disparity * down];
}

/** The real camera nearest to a viewpoint whose pictures can be decoded. */
export function nearestCamera(header: Header, view: Viewpoint): Camera {
  const away = ({ row, col }: Camera) => (row - view.row) ** 2 + (col - view.col) ** 2;
  return cameras(header)
    .filter((camera) => playsAlone(header, camera))
    .reduce((best, camera) => (away(camera) < away(best) ? camera : best));
}

/** The span of neighbouring places that a coordinate lies in, the lower one on a border. */
function spanOf(places: readonly number[], value: number): [number, number] {
  for (let i = 1; i < places.length; i++) if (value <= places[i]) return [places[i - 1], places[i]];
  return [places[places.length - 1], places[places.length - 1]];
}

/**
 * The cameras of a viewpoint's cell that count, in row order.
 *
 * Towards a border to another cell the cameras across this cell fade out, so that the picture does not jump
 * where other cameras take over. Cameras without a picture are left out by `present`.
 */
export function contributors(
  header: Header, view: Viewpoint, present: (camera: Camera) => boolean = () => true,
): Contributor[] {
  if (!isSynthesised(header)) {
    const camera = nearestCamera(header, view);
    return present(camera) ? [{ camera, shift: [0, 0], weight: 1 }] : [];
  }
  const [top, bottom] = spanOf(header.realRows, view.row);
  const [left, right] = spanOf(header.realCols, view.col);
  const step = steps(header);
  const found: Contributor[] = [];
  for (const row of new Set([top, bottom])) {
    for (const col of new Set([left, right])) {
      const across = step.col ? Math.abs(view.col - col) / step.col : 0;
      const down = step.row ? Math.abs(view.row - row) / step.row : 0;
      let weight = 1 / (SPREAD + across ** 2 + down ** 2);
      if ((col === left && right < header.cols - 1) || (col === right && left > 0)) {
        weight *= Math.min(1, (1 - across) / FADE);
      }
      if ((row === top && bottom < header.rows - 1) || (row === bottom && top > 0)) {
        weight *= Math.min(1, (1 - down) / FADE);
      }
      const camera = { row, col };
      if (weight > 0 && present(camera)) found.push({ camera, shift: shiftTo(header, view, camera), weight });
    }
  }
  return found;
}

/** The cameras that some views need together. */
export function camerasOf(header: Header, views: readonly Viewpoint[]): Camera[] {
  const found = new Map<string, Camera>();
  for (const view of views) {
    for (const { camera } of contributors(header, view)) found.set(`${camera.row},${camera.col}`, camera);
  }
  return [...found.values()];
}

/** 1 - 1 / the most that what is nearest is enlarged by. */
const MOST_DOLLY = 0.2;

/** The limit of `ViewSettings.dolly`: what is nearest is enlarged by a quarter at most, which keeps holes few. */
export function mostDolly(header: Header): number {
  return MOST_DOLLY / Math.max(header.range[1] - infinityOf(header), 1e-3);
}

/** Steps of the baseline that disparity belongs to: the horizontal one where there is one. */
function baselineSteps(header: Header): number {
  const step = steps(header);
  return step.col || step.row || 1;
}

/** Disparity of infinitely distant points, px. */
export function infinityOf(header: Header): number {
  return header.calibration.dInf * baselineSteps(header);
}

/** Depth of a disparity in metres; undefined where the calibration is nominal or the point is at infinity. */
export function depthOf(header: Header, disparity: number): number | undefined {
  const { calibration: c } = header;
  const beyond = disparity - infinityOf(header);
  if (!c.given || beyond <= 0) return undefined;
  return ((header.cols === 1 ? c.fy : c.fx) * c.baselineM * baselineSteps(header)) / beyond;
}
