import assert from "node:assert/strict";
import { test } from "node:test";
import type { Header } from "../src/container/header.ts";
import { eyeCells, viewsOf } from "../src/player/head.ts";

/** 2 x 2 cameras at the corners of 3 x 3 views, twice as far apart downwards as across. */
const HEADER = {
  rows: 3, cols: 3, realRows: [0, 2], realCols: [0, 2], rho: 2, width: 640, range: [0, 38.4], mapCameras: "all", predicted: [],
} as unknown as Header;
const HOME = { row: 1, col: 1 };
const FIRST = { x: 0, y: 1.6 };
const eyes = (x: number, y: number) => [{ x: x - 0.03, y }, { x: x + 0.03, y }];

test("eyes are half a cell apart, or as far as parallax of 3 % of the width allows", () => {
  assert.equal(eyeCells(HEADER), 0.5);
  assert.ok(Math.abs(eyeCells({ ...HEADER, range: [0, 76.8] } as Header) - 0.25) < 1e-9);
});

test("the head's first place sees home from both sides", () => {
  const [left, right] = viewsOf(HEADER, HOME, FIRST, eyes(0, 1.6), 5);
  assert.deepEqual([left.row, right.row], [1, 1]);
  assert.ok(Math.abs(left.col - 0.7) < 1e-9 && Math.abs(right.col - 1.3) < 1e-9);
});

test("a head that goes right and up sees from the right and from above, by the array's own distances", () => {
  const [left] = viewsOf(HEADER, HOME, FIRST, eyes(0.02, 1.64), 5);
  assert.ok(Math.abs(left.col - 0.9) < 1e-9);
  assert.ok(Math.abs(left.row - 0.8) < 1e-9);
});

test("at the array's border both eyes stop together, still apart", () => {
  for (const x of [-3, 3]) {
    const [left, right] = viewsOf(HEADER, HOME, FIRST, eyes(x, 9), 5);
    assert.ok(Math.abs(right.col - left.col - 0.6) < 1e-9);
    assert.ok(left.col >= 0 && right.col <= 2 && left.row === 0);
  }
});
