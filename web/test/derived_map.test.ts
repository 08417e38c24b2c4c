import assert from "node:assert/strict";
import { test } from "node:test";
import type { Header } from "../src/container/header.ts";
import { deriveMap, helpersOf } from "../src/decode/derived_map.ts";
import { contributors } from "../src/geometry.ts";

const HEADER = {
  rows: 1, cols: 3, width: 40, height: 9, realRows: [0], realCols: [0, 2], rho: 1, range: [0, 255], mapScale: 1,
  mapCameras: "alternate", predicted: [], calibration: { dInf: 0, given: true, fx: 40, fy: 40, baselineM: 1 },
} as unknown as Header;

test("the camera beside one that sends a map is derived from it", () => {
  assert.deepEqual(helpersOf(HEADER, { row: 0, col: 2 }), [{ row: 0, col: 0 }]);
});

test("a near thing moves by its disparity, and what it uncovers is background", () => {
  const near = 10;
  const far = 2;
  const codes = new Uint8Array(40 * 9).fill(far);
  for (let y = 0; y < 9; y++) codes.fill(near, y * 40 + 20, y * 40 + 30);
  const derived = deriveMap(HEADER, { row: 0, col: 2 }, [{ camera: { row: 0, col: 0 }, codes }]);
  const row = [...derived.subarray(4 * 40, 5 * 40)];
  assert.deepEqual(row.slice(10, 20), Array(10).fill(near));
  assert.deepEqual(row.slice(0, 9), Array(9).fill(far));
  assert.deepEqual(row.slice(21), Array(19).fill(far));
});

test("cameras across a cell fade out towards a border to another one", () => {
  const grid = { ...HEADER, cols: 5, realCols: [0, 2, 4] } as Header;
  const weights = (col: number) => contributors(grid, { row: 0, col }).map(({ camera, weight }) => [camera.col, weight]);
  const atBorder = weights(1.999);
  assert.ok(Number(atBorder[0][1]) < 0.01 * Number(atBorder[1][1]));
  assert.equal(weights(1).length, 2);
});
