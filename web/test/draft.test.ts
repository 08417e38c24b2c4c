import assert from "node:assert/strict";
import { test } from "node:test";
import type { Header } from "../src/container/header.ts";
import { Draft, type DraftCamera } from "../src/synthesis/draft.ts";

const [WIDTH, HEIGHT] = [64, 48];
const HEADER = {
  width: WIDTH, height: HEIGHT, rows: 1, cols: 3, realRows: [0], realCols: [0, 2], rho: 1, mapScale: 2, range: [0, 20],
  calibration: { fx: 100, fy: 100, baselineM: 0.1, dInf: 0, given: true },
} as unknown as Header;
const PICTURE = { look: "picture", dolly: 0 } as const;

/** A camera that sees grey of some brightness and code values, by place. */
function camera(shift: number, luma: (x: number, y: number) => number, code: (x: number, y: number) => number): DraftCamera {
  const plane = (width: number, height: number, at: (x: number, y: number) => number) =>
    Uint8Array.from({ length: width * height }, (_, i) => at(i % width, Math.floor(i / width)));
  const picture = {
    width: WIDTH, height: HEIGHT, y: plane(WIDTH, HEIGHT, luma),
    u: plane(WIDTH / 2, HEIGHT / 2, () => 128), v: plane(WIDTH / 2, HEIGHT / 2, () => 128),
  };
  const map = plane(WIDTH / 2, HEIGHT / 2, (x, y) => code(2 * x, 2 * y));
  return { frame: { camera: { row: 0, col: 0 }, picture, map }, shift: [shift, 0], weight: 1 };
}

function red(pixels: Uint8Array, x: number, y: number, width = WIDTH): number {
  return pixels[4 * (y * width + x)];
}

const FLAT = 102; // 8 px

test("a plane is shown where the view sees it, in RGB of full range", () => {
  const ramp = (x: number) => 16 + 3 * x;
  const pixels = new Draft(HEADER).make([camera(0.5, ramp, () => FLAT)], PICTURE, WIDTH, HEIGHT);
  for (const x of [8, 20, 41]) assert.ok(Math.abs(red(pixels, x, 20) - ((3 * (x + 4)) * 255) / 219) <= 2);
  assert.equal(pixels[3], 255);
});

test("what is near hides what is behind it, and what no camera sees is like the background", () => {
  // 20 px near against 0 px far: the view moves it by 10 px to the left, and uncovers what was behind it.
  const isNear = (x: number, y: number) => x >= 30 && x < 40 && y >= 16 && y < 32;
  const one = camera(0.5, (x, y) => (isNear(x, y) ? 200 : 60), (x, y) => (isNear(x, y) ? 255 : 1));
  const pixels = new Draft(HEADER).make([one], PICTURE, WIDTH, HEIGHT);
  const dark = ((60 - 16) * 255) / 219;
  assert.ok(red(pixels, 25, 24) > 200);
  assert.ok(Math.abs(red(pixels, 12, 24) - dark) <= 2);
  assert.ok(Math.abs(red(pixels, 50, 24) - dark) <= 2);
});

test("two cameras that agree are mixed by their weights", () => {
  const cameras = [camera(0.5, () => 100, () => FLAT), { ...camera(-0.5, () => 200, () => FLAT), weight: 0.25 }];
  const pixels = new Draft(HEADER).make(cameras, PICTURE, WIDTH, HEIGHT);
  assert.ok(Math.abs(red(pixels, 30, 20) - ((120 - 16) * 255) / 219) <= 2);
});

test("smaller drafts, drafts from ahead and moved ones show the same scene", () => {
  const ramp = (x: number) => 16 + 3 * x;
  const draft = new Draft(HEADER);
  const cameras = [camera(0, ramp, () => 255)];
  const small = draft.make(cameras, PICTURE, WIDTH / 2, HEIGHT / 2);
  assert.ok(Math.abs(red(small, 16, 12, WIDTH / 2) - (3 * 32.5 * 255) / 219) <= 4);
  const moved = draft.make(cameras, { ...PICTURE, offset: [5, 0] }, WIDTH, HEIGHT);
  assert.ok(Math.abs(red(moved, 20, 20) - (3 * 25 * 255) / 219) <= 2);
  const ahead = draft.make(cameras, { ...PICTURE, dolly: 0.2 / 20 }, WIDTH, HEIGHT);
  const seenAt = 31.5 + (10 - 31.5) * 0.8;
  assert.ok(Math.abs(red(ahead, 10, 20) - (3 * seenAt * 255) / 219) <= 5);
});

test("looks have the colours of the shader, and the picture left of the divider", () => {
  const isNear = (x: number) => x >= 30 && x < 44;
  const one = camera(0, () => 126, (x) => (isNear(x) ? 255 : 1));
  const other = { ...camera(0, () => 226, (x) => (isNear(x) ? 255 : 1)) };
  const draft = new Draft(HEADER);
  const rgb = (pixels: Uint8Array, x: number) => [...pixels.subarray(4 * (20 * WIDTH + x), 4 * (20 * WIDTH + x) + 3)];
  const isAbout = (found: number[], expected: number[]) =>
    found.forEach((value, i) => assert.ok(Math.abs(value - 255 * expected[i]) <= 3, `${found} is not ${expected}`));
  const disparity = draft.make([one], { ...PICTURE, look: "disparity", wipe: 0.25 }, WIDTH, HEIGHT);
  isAbout(rgb(disparity, 36), [1, 0.95, 0.4]);
  isAbout(rgb(disparity, 56), [0.05, 0.07, 0.35]);
  isAbout(rgb(disparity, 4), [110 / 219, 110 / 219, 110 / 219]);
  const green = 110 / 219;
  const provenance = draft.make([one], { ...PICTURE, look: "provenance" }, WIDTH, HEIGHT);
  isAbout(rgb(provenance, 56), [0.95, 0.7, 0.2].map((value) => 0.7 * value + 0.3 * green));
  const both = draft.make([one, other], { ...PICTURE, look: "provenance" }, WIDTH, HEIGHT);
  const mean = 160 / 219;
  isAbout(rgb(both, 56), [0.1, 0.65, 0.4].map((value) => 0.7 * value + 0.3 * mean));
  const layers = draft.make([one], { ...PICTURE, look: "layers" }, WIDTH, HEIGHT);
  assert.ok(rgb(layers, 36)[0] > 2 * rgb(layers, 56)[0]);
  isAbout(rgb(draft.make([one, other], { ...PICTURE, look: "disagreement" }, WIDTH, HEIGHT), 56), [1, 0.95, 0.4]);
  isAbout(rgb(draft.make([one, one], { ...PICTURE, look: "disagreement" }, WIDTH, HEIGHT), 56), [0.05, 0.07, 0.35]);
});
