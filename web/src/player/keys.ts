/** Which key does what; `KEYS` of the texts lists them for people. */

import { button, element } from "./dom.ts";
import { SPEEDS } from "./playback.ts";
import { KEYS, TEXTS } from "./texts.ts";
import type { Ui } from "./ui.ts";

export function keyActions(ui: Ui): ReadonlyMap<string, () => void> {
  const nextSpeed = (by: number) => {
    const place = SPEEDS.findIndex((speed) => speed >= ui.speed);
    ui.changeSpeed(SPEEDS[Math.min(Math.max(place + by, 0), SPEEDS.length - 1)]);
  };
  return new Map([
    [" ", () => ui.togglePlay()],
    ["k", () => ui.togglePlay()],
    ["ArrowLeft", () => ui.looking.key(0, -1)],
    ["ArrowRight", () => ui.looking.key(0, 1)],
    ["ArrowUp", () => ui.looking.key(-1, 0)],
    ["ArrowDown", () => ui.looking.key(1, 0)],
    [",", () => ui.step(-1)],
    [".", () => ui.step(1)],
    ["j", () => ui.skip(-1)],
    ["l", () => ui.skip(1)],
    ["Home", () => ui.seekTo(0)],
    ["End", () => ui.seekTo(Infinity)],
    ["+", () => nextSpeed(1)],
    ["-", () => nextSpeed(-1)],
    ["a", () => ui.markSection("from")],
    ["b", () => ui.markSection("to")],
    ["v", () => ui.nextLook()],
    ["e", () => ui.nextEyes()],
    ["w", () => ui.dolly(0.2)],
    ["s", () => ui.dolly(-0.2)],
    ["h", () => ui.toggleHover()],
    ["p", () => ui.savePicture()],
    ["c", () => void ui.copyLink()],
    ["o", () => ui.openFile()],
    ["f", () => ui.toggleFullscreen()],
    ["i", () => ui.toggleStatistics()],
    ["?", () => ui.showHelp()],
  ]);
}

/** Whether a key is meant for the control that has the focus, or for the browser. */
export function isForControl(event: KeyboardEvent): boolean {
  const target = event.composedPath()[0];
  if (event.ctrlKey || event.metaKey || event.altKey || target instanceof HTMLSelectElement) return true;
  if (target instanceof HTMLInputElement) return target.type !== "range" || /^(Arrow|Home|End)/.test(event.key);
  return target instanceof HTMLButtonElement && (event.key === " " || event.key === "Enter");
}

/** The dialog that lists the keys. */
export function keyList(): HTMLDialogElement {
  const dialog = element("dialog", { "aria-label": TEXTS.help });
  const list = element("dl");
  for (const [keys, text] of KEYS) {
    list.append(element("dt", {}, ...keys.split(" ").map((key) => element("kbd", {}, key))), element("dd", {}, text));
  }
  const close = button(TEXTS.close, TEXTS.close, () => dialog.close());
  dialog.append(element("form", {}, element("h2", {}, TEXTS.help), close), list);
  return dialog;
}
