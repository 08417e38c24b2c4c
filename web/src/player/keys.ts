/** Which key does what; `KEYS` of the texts lists them for people. */

import { button, element } from "./dom.ts";
import { KEYS, TEXTS } from "./texts.ts";
import type { Ui } from "./ui.ts";

/** `isFar`: with the shift key. */
export function keyActions(ui: Ui): ReadonlyMap<string, (isFar: boolean) => void> {
  const { commands } = ui;
  const { looking } = commands;
  return new Map<string, (isFar: boolean) => void>([
    [" ", () => commands.togglePlay()],
    ["k", () => commands.togglePlay()],
    ["ArrowLeft", (isFar) => looking.key(0, -1, isFar)],
    ["ArrowRight", (isFar) => looking.key(0, 1, isFar)],
    ["ArrowUp", (isFar) => looking.key(-1, 0, isFar)],
    ["ArrowDown", (isFar) => looking.key(1, 0, isFar)],
    ["g", () => looking.goToNearest()],
    [",", () => commands.step(-1)],
    [".", () => commands.step(1)],
    ["j", () => commands.skip(-1)],
    ["l", () => commands.skip(1)],
    ["Home", () => commands.seekTo(0)],
    ["End", () => commands.seekTo(Infinity)],
    ["+", () => commands.changeSpeed(1)],
    ["-", () => commands.changeSpeed(-1)],
    ["a", () => commands.markSection("from")],
    ["b", () => commands.markSection("to")],
    ["v", () => commands.nextLook()],
    ["e", () => commands.nextEyes()],
    ["[", () => commands.changeEyes(-1)],
    ["]", () => commands.changeEyes(1)],
    ["w", () => commands.dolly(0.2)],
    ["s", () => commands.dolly(-0.2)],
    ["h", () => commands.toggleHover()],
    ["p", () => commands.savePicture()],
    ["c", () => void commands.copyLink()],
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
