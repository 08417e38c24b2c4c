import assert from "node:assert/strict";
import { test } from "node:test";
import { Marks } from "../src/player/section.ts";
import { parseView, timeText } from "../src/player/format.ts";

test("one mark loops to the file's end, two between them", () => {
  const section = new Marks();
  assert.deepEqual(section.mark("from", 0.2, 0.5), { from: 0.2, to: 0.5 });
  assert.deepEqual(section.mark("to", 0.4, 0.5), { from: 0.2, to: 0.4 });
});

test("a mark that is set where it is ends the loop, and so does an empty one", () => {
  const section = new Marks();
  section.mark("from", 0.2, 0.5);
  assert.equal(section.mark("from", 0.2, 0.5), undefined);
  section.mark("to", 0.3, 0.5);
  assert.equal(section.mark("from", 0.4, 0.5), undefined);
});

test("times and viewpoints are read and written as people do", () => {
  assert.equal(timeText(0.99), "0:00.9");
  assert.equal(timeText(3661.25), "1:01:01.2");
  assert.deepEqual(parseView("0.5,1.25"), { row: 0.5, col: 1.25 });
  for (const text of [null, "", "1", "a,b", "1,2,3", ",1"]) assert.equal(parseView(text), undefined);
});
