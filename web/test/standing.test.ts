import assert from "node:assert/strict";
import { mock, test } from "node:test";
import { Standing } from "../src/player/standing.ts";

function standing() {
  mock.timers.enable({ apis: ["setTimeout"] });
  const stood = mock.fn();
  return { stood, it: new Standing(stood) };
}

test("a picture stands when nothing has changed for a while", () => {
  const { stood, it } = standing();
  it.moved();
  mock.timers.tick(100);
  it.moved();
  mock.timers.tick(100);
  assert.equal(stood.mock.callCount(), 0);
  mock.timers.tick(20);
  assert.equal(stood.mock.callCount(), 1);
  mock.timers.reset();
});

test("a picture that is held does not stand before it is let go", () => {
  const { stood, it } = standing();
  it.hold(true);
  it.moved();
  mock.timers.tick(5000);
  assert.equal(stood.mock.callCount(), 0);
  it.hold(false);
  mock.timers.tick(120);
  assert.equal(stood.mock.callCount(), 1);
  mock.timers.reset();
});

test("where pictures in all detail are slow, they are waited for as long as they take, and for a second at most", () => {
  const { stood, it } = standing();
  it.took(820);
  it.moved();
  mock.timers.tick(819);
  assert.equal(stood.mock.callCount(), 0);
  mock.timers.tick(1);
  assert.equal(stood.mock.callCount(), 1);
  it.took(60_000);
  assert.equal(it.patience, 1000);
  mock.timers.reset();
});
