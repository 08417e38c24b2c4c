import assert from "node:assert/strict";
import { test } from "node:test";
import { parseHeader } from "../src/container/header.ts";
import { FileError, LIMITS } from "../src/container/limits.ts";

const GOOD = {
  format: "mvcodec", version: 1, codec: "h264", disparity_range_px: [-3, 9.5],
  array: {
    rows: 3, cols: 5, width: 48, height: 32, fps: 29.97, real_rows: [0, 2], real_cols: [0, 2, 4], rho: 1.5, name: "",
    calibration: { fx_px: 50, fy_px: 52, cx_px: 24, cy_px: 15, baseline_m: 0.03, d_inf_px_per_step: 0.25, given: true },
  },
};
const parse = (document: unknown) => parseHeader(new TextEncoder().encode(JSON.stringify(document)));
const withArray = (fields: object) => ({ ...GOOD, array: { ...GOOD.array, ...fields } });

test("absent fields mean maps of full size from every camera", () => {
  const header = parse(GOOD);
  assert.equal(header.mapScale, 1);
  assert.equal(header.mapCameras, "all");
});

test("files without maps are of version 2", () => {
  assert.throws(() => parse({ ...GOOD, disparity_cameras: "none" }), FileError);
  assert.equal(parse({ ...GOOD, version: 2, disparity_cameras: "none" }).mapCameras, "none");
});

test("cameras that are predicted from others are known by their places", () => {
  const prediction = { predictor: "warp-1", codec: "vp9", cameras: [{ camera: [0, 2], from: [[0, 0]] }] };
  assert.deepEqual(parse({ ...GOOD, version: 2, prediction }).predicted, [[0, 2]]);
  const wrong = { ...prediction, cameras: [{ camera: [1, 2], from: [[0, 0]] }] };
  assert.throws(() => parse({ ...GOOD, version: 2, prediction: wrong }), FileError);
});

for (const [what, document] of Object.entries({
  "another format": { ...GOOD, format: "other" },
  "a later version": { ...GOOD, version: 3 },
  "an unknown codec": { ...GOOD, codec: "mpeg2" },
  "no range": { ...GOOD, disparity_range_px: [4, 4] },
  "a text for a number": withArray({ width: "48" }),
  "cameras that are not equally spaced": withArray({ real_cols: [0, 1, 4] }),
  "cameras that leave out the last column": withArray({ real_cols: [0, 2] }),
  "a frame rate of none": withArray({ fps: 0 }),
  "no object": [GOOD],
})) {
  test(`${what} is refused, in one line`, () => {
    assert.throws(() => parse(document), (error: Error) => error instanceof FileError && !error.message.includes("\n"));
  });
}

test("hostile sizes are refused by the limits", () => {
  assert.throws(() => parse(withArray({ width: 16384, height: 16384 })), new RegExp(String(LIMITS.setPixels)));
  assert.throws(() => parseHeader(new Uint8Array(LIMITS.headerBytes + 1)), new RegExp(String(LIMITS.headerBytes)));
});
