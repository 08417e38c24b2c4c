/** Maps of cameras that send none, out of those of the cameras around them (FORMAT.md, `disparity_cameras`). */

import type { Header } from "../container/header.ts";
import { sendsMap } from "../container/messages.ts";
import { cameras, shiftTo, type Camera } from "../geometry.ts";

/** Maps that differ by less are of one surface, and are averaged; px. */
const AGREEMENT_PX = 2;
const NOTHING = -1;

/** How far around its place a sample covers whole places: the ones on both sides, so that slanted surfaces get no cracks. */
const BOTH_SIDES = 0.999;
/** With half-size maps, little more than the nearest one: a whole sample more would make near things two pixels wider. */
const NEAREST = 0.54;

/** A map as coded: code values, of the size that is coded. */
export interface CodedMap {
  readonly camera: Camera;
  readonly codes: Uint8Array;
}

/** The nearest cameras that send a map, in cells. */
export function helpersOf(header: Header, camera: Camera): Camera[] {
  const place = (one: Camera) => [header.realRows.indexOf(one.row), header.realCols.indexOf(one.col)];
  const [row, col] = place(camera);
  const away = cameras(header)
    .filter((other) => sendsMap(header, other))
    .map((other) => ({ other, distance: (place(other)[0] - row) ** 2 + (place(other)[1] - col) ** 2 }));
  const least = Math.min(...away.map(({ distance }) => distance));
  return away.filter(({ distance }) => distance === least).map(({ other }) => other);
}

/** The code values of a camera's map: of what the others see there, the nearest surface. */
export function deriveMap(header: Header, camera: Camera, maps: readonly CodedMap[]): Uint8Array {
  const width = Math.ceil(header.width / header.mapScale);
  const height = Math.ceil(header.height / header.mapScale);
  const perCode = (header.range[1] - header.range[0]) / 255;
  const moved = maps.map((map) => moveMap(header, map, camera, width, height));
  const merged = merge(moved, AGREEMENT_PX / perCode, width * height);
  fillRows(merged, width, height);
  return median5(merged, width, height);
}

/** Each sample to the whole places around where the camera sees it; the nearest stays. */
function moveMap(header: Header, map: CodedMap, camera: Camera, width: number, height: number): Int16Array {
  const out = new Int16Array(width * height).fill(NOTHING);
  const [low, high] = header.range;
  const [across, down] = shiftTo(header, camera, map.camera);
  const reach = header.mapScale === 1 ? BOTH_SIDES : NEAREST;
  const places = Array.from({ length: 256 }, (_, code) => {
    const d = (low + (code * (high - low)) / 255) / header.mapScale;
    return [across * d, down * d];
  });
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const code = map.codes[y * width + x];
      const toX = x - places[code][0];
      const toY = y - places[code][1];
      const right = Math.min(Math.floor(toX + reach), width - 1);
      const bottom = Math.min(Math.floor(toY + reach), height - 1);
      for (let v = Math.max(Math.ceil(toY - reach), 0); v <= bottom; v++) {
        for (let u = Math.max(Math.ceil(toX - reach), 0); u <= right; u++) {
          if (out[v * width + u] < code) out[v * width + u] = code;
        }
      }
    }
  }
  return out;
}

/** Of several maps the nearest at each pixel, averaged with those that agree with it. */
function merge(moved: readonly Int16Array[], agreement: number, count: number): Int16Array {
  const out = new Int16Array(count).fill(NOTHING);
  for (let i = 0; i < count; i++) {
    let nearest = NOTHING;
    for (const map of moved) nearest = Math.max(nearest, map[i]);
    if (nearest === NOTHING) continue;
    let [sum, agreeing] = [0, 0];
    for (const map of moved) {
      if (map[i] !== NOTHING && map[i] > nearest - agreement) {
        sum += map[i];
        agreeing++;
      }
    }
    out[i] = Math.round(sum / agreeing);
  }
  return out;
}

/** Where nothing came, the farther side of the row goes on; an empty row is like the nearest one that is not. */
function fillRows(map: Int16Array, width: number, height: number): void {
  const known: number[] = [];
  for (let y = 0; y < height; y++) {
    const row = map.subarray(y * width, (y + 1) * width);
    if (row.some((code) => code !== NOTHING)) known.push(y);
    for (let x = 0; x < width; x++) {
      if (row[x] !== NOTHING) continue;
      let end = x;
      while (end < width && row[end] === NOTHING) end++;
      const sides = [row[x - 1], row[end]].filter((code) => code !== undefined);
      row.fill(sides.length > 0 ? Math.min(...sides) : NOTHING, x, end);
      x = end;
    }
  }
  for (let y = 0; y < height; y++) {
    if (map[y * width] !== NOTHING) continue;
    let from = known[0];
    for (const row of known) if (Math.abs(row - y) < Math.abs(from - y)) from = row;
    if (from === undefined) map.fill(0, y * width, (y + 1) * width);
    else map.copyWithin(y * width, from * width, (from + 1) * width);
  }
}

/** Median of 5 x 5 pixels, those beyond the border being the nearest inside (Huang 1979: a sliding histogram). */
function median5(map: Int16Array, width: number, height: number): Uint8Array {
  const out = new Uint8Array(map.length);
  const counts = new Uint16Array(256);
  const rows = [0, 0, 0, 0, 0];
  for (let y = 0; y < height; y++) {
    for (let k = 0; k < 5; k++) rows[k] = Math.min(Math.max(y + k - 2, 0), height - 1) * width;
    counts.fill(0);
    for (let x = -2; x <= 2; x++) for (const row of rows) counts[map[row + Math.min(Math.max(x, 0), width - 1)]]++;
    let code = 0;
    let below = 0; // samples of the window that are less than `code`
    for (let x = 0; x < width; x++) {
      // The median changes little from one place to the next.
      while (below > 12) below -= counts[--code];
      while (below + counts[code] < 13) below += counts[code++];
      out[y * width + x] = code;
      const [left, right] = [Math.max(x - 2, 0), Math.min(x + 3, width - 1)];
      for (let k = 0; k < 5; k++) {
        const [gone, come] = [map[rows[k] + left], map[rows[k] + right]];
        if (gone === come) continue;
        counts[gone]--;
        counts[come]++;
        below += Number(come < code) - Number(gone < code);
      }
    }
  }
  return out;
}
