import assert from "node:assert/strict";
import { test } from "node:test";
import { pictureOrder } from "../src/decode/picture_order.ts";

/** Heads of seven HEVC pictures by x265, each built on the one before: parameter sets, and the first bytes of slices. */
const HEVC = [
  "00000142010101600000030090000003000003001ea0208316596ae4cae6a0202020800000030080000005040000014401c171a1120000012801af5823be4628a0aa9bfdd97877e3fb9ed1cb206575d0df030c4b",
  "0000010201d0097e11188cfe54644ee760ce9b0e188ef603d41782b883504f",
  "0000010201d011ffd4430621fcb9cfc13bdbe1c430e65108d2f18a84de62d8",
  "0000010201d0189ffdc4301884fc39b6ababcb89358406853b849165ffe730",
  "0000010201d020bfff2443006230ee218df9",
  "0000010201d028bfff2443006210ee218df9",
  "0000010201d030bfff2443006230ee218df9",
].map((text) => Uint8Array.from(text.match(/../g)!, (byte) => parseInt(byte, 16)));

const [SKIPPED, KEY] = [3, 0];

test("HEVC pictures that are all there follow each other", () => {
  const order = pictureOrder("hevc");
  assert.deepEqual(HEVC.map((unit, i) => order.follows(unit, i === KEY, i)), HEVC.map(() => true));
});

test("an HEVC picture that is missing is noticed up to the next keyframe", () => {
  const order = pictureOrder("hevc");
  const found = HEVC.map((unit, i) => i !== SKIPPED && order.follows(unit, i === KEY, i));
  assert.equal(found.indexOf(false, SKIPPED + 1), SKIPPED + 1);
  assert.ok(order.follows(HEVC[KEY], true, 7));
  assert.ok(order.follows(HEVC[1], false, 8));
});

test("HEVC pictures without a keyframe follow nothing, and headers that break off are refused", () => {
  assert.equal(pictureOrder("hevc").follows(HEVC[1], false, 1), false);
  assert.throws(() => pictureOrder("hevc").follows(HEVC[KEY].subarray(0, 20), true, 0));
});
