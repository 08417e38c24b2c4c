import assert from "node:assert/strict";
import { test } from "node:test";
import { Tempo } from "../src/player/tempo.ts";

/** Draw so many pictures, each so long after the one before. */
function draw(tempo: Tempo, count: number, intervalMs: number, periodMs = 0): void {
  tempo.rest();
  for (let i = 0; i <= count; i++) tempo.drawn(i * intervalMs, periodMs);
}

test("pictures that come too slowly get less detail, down to a limit", () => {
  const tempo = new Tempo();
  draw(tempo, 8, 60);
  assert.equal(tempo.detail, 0.75);
  draw(tempo, 1000, 60);
  assert.equal(tempo.detail, 0.375);
});

test("where they come soon enough, more is tried, and less often each time that it was too much", () => {
  const tempo = new Tempo();
  draw(tempo, 8, 60);
  const until = (detail: number, intervalMs: number) => {
    let count = 0;
    while (tempo.detail !== detail) {
      draw(tempo, 1, intervalMs);
      count++;
    }
    return count;
  };
  const first = until(1, 17);
  until(0.75, 60);
  assert.ok(until(1, 17) > 1.5 * first);
});

test("a picture that only frames change is in time with its frames", () => {
  const tempo = new Tempo();
  draw(tempo, 100, 100, 100);
  assert.equal(tempo.detail, 1);
  draw(tempo, 100, 100);
  assert.ok(tempo.detail < 1);
});

test("moving pictures are as fine as those that stand only where that takes no time", () => {
  const tempo = new Tempo();
  draw(tempo, 100, 17);
  assert.equal(tempo.allowsFine(undefined), false);
  assert.equal(tempo.allowsFine(300), false);
  assert.equal(tempo.allowsFine(9), true);
});
