import assert from "node:assert/strict";
import { test } from "node:test";
import type { Header } from "../src/container/header.ts";
import { infinityOf } from "../src/geometry.ts";
import { BLOCK, Bounds } from "../src/synthesis/bounds.ts";

const HEADER = {
  width: 90, height: 70, rows: 3, cols: 3, realRows: [0, 2], realCols: [0, 2], rho: 1, mapScale: 1, range: [2, 30],
  calibration: { fx: 100, fy: 100, baselineM: 0.1, dInf: 0.5, given: true },
} as unknown as Header;

/** Disparities of two surfaces and what lies between, code values. */
function surfaces(): Uint8Array {
  const map = new Uint8Array(HEADER.width * HEADER.height);
  for (let i = 0; i < map.length; i++) map[i] = (i * 7919) % 13 === 0 ? 220 : 30 + (i % 40);
  return map;
}

test("a tile's bounds hold every pixel of a camera that the view sees there, from ahead too", () => {
  const bounds = new Bounds(HEADER);
  const map = surfaces();
  const infinity = infinityOf(HEADER);
  const [middleX, middleY] = [(HEADER.width - 1) / 2, (HEADER.height - 1) / 2];
  for (const dolly of [0, 0.2 / (HEADER.range[1] - infinity)]) {
    for (const shift of [[0.5, -0.25], [-1, 0]] as const) {
      bounds.update([{ map, shift }], dolly);
      for (let i = 0; i < map.length; i++) {
        const d = HEADER.range[0] + (map[i] / 255) * (HEADER.range[1] - HEADER.range[0]);
        const scale = 1 / (1 - dolly * (d - infinity));
        const x = ((i % HEADER.width) - shift[0] * d - middleX) * scale + middleX;
        const y = (Math.floor(i / HEADER.width) - shift[1] * d - middleY) * scale + middleY;
        if (x < 0 || y < 0 || x > HEADER.width - 1 || y > HEADER.height - 1) continue;
        const tile = 4 * (Math.floor(y / BLOCK) * bounds.across + Math.floor(x / BLOCK));
        assert.ok(bounds.nears[tile] >= map[i] && 255 - bounds.fars[tile] <= map[i]);
      }
    }
  }
});

test("channels of cameras that are not there say so", () => {
  const bounds = new Bounds(HEADER);
  bounds.update([{ map: surfaces(), shift: [0, 0] }], 0);
  assert.ok(bounds.nears.every((code, i) => (i % 4 === 0) === code > 0));
});
