import assert from "node:assert/strict";
import { test } from "node:test";
import { Playback } from "../src/player/playback.ts";

function playing(from = 0): Playback {
  const playback = new Playback();
  playback.setEnd(2);
  playback.play(from);
  playback.timeAt(0);
  return playback;
}

test("time goes on with the clock, at the speed", () => {
  const playback = playing();
  assert.equal(playback.timeAt(500), 0.5);
  playback.setSpeed(0.1);
  assert.ok(Math.abs(playback.timeAt(1500) - 0.6) < 1e-9);
});

test("it begins again at the end, or stops where it is not to loop", () => {
  assert.ok(Math.abs(playing(1.9).timeAt(300) - 0.2) < 1e-9);
  const once = playing(1.9);
  once.loops = false;
  assert.ok(once.timeAt(300) < 2);
  assert.equal(once.isPlaying, false);
});

test("a section is played over and over", () => {
  const playback = playing(0.5);
  playback.section = { from: 0.5, to: 1 };
  assert.ok(Math.abs(playback.timeAt(700) - 0.7) < 1e-9);
});

test("playing at the end starts over", () => {
  assert.equal(playing(2).timeAt(0), 0);
});
