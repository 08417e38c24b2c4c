/** What the colours of a look mean, and how good a view is beside its original. */

import type { Look } from "../synthesis/looks.ts";
import { drawing, element } from "./dom.ts";
import { TEXTS } from "./texts.ts";

export interface Legend {
  /** Empty: there is nothing to be said. */
  readonly text: string;
  /** From the least to the most. */
  readonly scale?: { readonly low: number; readonly high: number; readonly colours: readonly string[] };
  /** Each with the share of the picture that has it. */
  readonly classes?: readonly { readonly colour: string; readonly text: string; readonly share: number }[];
}

/** From far to near, as `ramp` of `view.frag.glsl`. */
const COLOURS = ["#0d1259", "#bf3373", "#fff266"];

/** The legend of a look that this page draws; `range`: the disparities that there may be, px; `psnr`: dB against the original. */
export function legendOf(look: Look, range: readonly [number, number], psnr: number | undefined): Legend {
  const text = [TEXTS.legends[look], psnr === undefined ? "" : TEXTS.psnr(psnr)].filter(Boolean).join(". ");
  return look === "disparity" ? { text, scale: { low: range[0], high: range[1], colours: COLOURS } } : { text };
}

export class LegendBox {
  readonly box = element("div", { class: "legend", role: "status", hidden: true });
  #shown = "";

  show(legend: Legend): void {
    const key = JSON.stringify(legend);
    if (key === this.#shown) return; // it is read aloud when it changes
    this.#shown = key;
    this.box.hidden = legend.text === "";
    this.box.replaceChildren(element("p", {}, legend.text));
    if (legend.scale !== undefined) this.box.append(bar(legend.scale.colours), ends(legend.scale));
    if (legend.classes !== undefined) this.box.append(list(legend.classes));
  }
}

function bar(colours: readonly string[]): SVGElement {
  const most = colours.length - 1;
  const stops = colours.map((colour, i) => drawing("stop", { offset: String(i / most), "stop-color": colour }));
  return drawing("svg", { class: "scale", viewBox: `0 0 ${most} 1`, preserveAspectRatio: "none", "aria-hidden": "true" },
    drawing("linearGradient", { id: "scale" }, ...stops),
    drawing("rect", { width: String(most), height: "1", fill: "url(#scale)" }));
}

function ends({ low, high }: { low: number; high: number }): HTMLElement {
  const short = (value: number) => String(Math.round(value * 100) / 100);
  return element("p", { class: "ends" }, element("span", {}, short(low)), element("span", {}, short(high)));
}

function list(classes: NonNullable<Legend["classes"]>): HTMLElement {
  return element("ul", {}, ...classes.map(({ colour, text, share }) => element("li", {},
    drawing("svg", { viewBox: "0 0 14 14", "aria-hidden": "true" }, drawing("rect", { width: "14", height: "14", rx: "3", fill: colour })),
    element("span", {}, text),
    element("span", {}, `${(100 * share).toFixed(1)} %`))));
}
