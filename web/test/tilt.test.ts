import assert from "node:assert/strict";
import { test } from "node:test";
import { uprightAngles } from "../src/player/tilt.ts";

test("a phone that is turned to the right looks to the right, whichever side is up", () => {
  // The device's own axes: gamma rises to its right, beta towards its lower side.
  assert.deepEqual(uprightAngles(40, 10, 0), { right: 10, down: 40 });
  assert.deepEqual(uprightAngles(10, -40, 90), { right: 10, down: 40 });
  assert.deepEqual(uprightAngles(-10, 40, 270), { right: 10, down: 40 });
  assert.deepEqual(uprightAngles(-40, -10, 180), { right: 10, down: 40 });
});
