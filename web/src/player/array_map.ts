/** A small map of the array: real cameras, views with pictures of their own, and the viewpoint; a press goes there. */

import type { Viewpoint } from "../geometry.ts";
import { drawing, element } from "./dom.ts";
import type { Engine } from "./engine.ts";
import { TEXTS } from "./texts.ts";

/** Places are shown up to so many. */
const MOST_DOTS = 400;
/** Of the longer side. */
const MARGIN = 0.14;
const SIDE_PX = 96;

export class ArrayMap {
  readonly box = element("div", { class: "map", hidden: true });
  readonly #drawing = drawing("svg", { tabindex: "0", role: "slider", "aria-label": TEXTS.map });
  #here: SVGElement | undefined;
  #spans: readonly [rows: number, cols: number] = [0, 0];
  #margin = 0;

  constructor(go: (view: Viewpoint) => void) {
    const svg = this.#drawing;
    this.box.append(svg);
    svg.addEventListener("pointerdown", (event) => {
      svg.setPointerCapture(event.pointerId);
      go(this.#placeOf(event));
    });
    svg.addEventListener("pointermove", (event) => {
      if (svg.hasPointerCapture(event.pointerId)) go(this.#placeOf(event));
    });
  }

  /** Draw another file's array; hidden where there is one camera. */
  build({ header, enhanced }: Engine): void {
    const { rows, cols, realRows, realCols } = header;
    this.box.hidden = rows * cols === 1;
    this.#spans = [rows - 1, cols - 1];
    const longest = Math.max(rows - 1, cols - 1, 1);
    this.#margin = MARGIN * longest;
    const [width, height] = [cols - 1 + 2 * this.#margin, rows - 1 + 2 * this.#margin];
    const svg = this.#drawing;
    svg.setAttribute("viewBox", `${-this.#margin} ${-this.#margin} ${width} ${height}`);
    svg.style.width = `${(SIDE_PX * width) / Math.max(width, height)}px`;
    svg.style.height = `${(SIDE_PX * height) / Math.max(width, height)}px`;
    svg.setAttribute("aria-valuemin", "0");
    svg.setAttribute("aria-valuemax", String(rows * cols - 1));
    const unit = longest / 60;
    const dot = (kind: string, row: number, col: number, size: number) =>
      drawing("circle", { class: kind, cx: String(col), cy: String(row), r: String(size * unit) });
    const places = rows * cols <= MOST_DOTS ? Array.from({ length: rows * cols }, (_, i) => dot("view", Math.floor(i / cols), i % cols, 1)) : [];
    const cameras = realRows.flatMap((row) => realCols.map((col) => dot("real", row, col, 3.4)));
    this.#here = dot("here", 0, 0, 4.2);
    svg.replaceChildren(...places, ...enhanced.map(([row, col]) => dot("real", row, col, 1.8)), ...cameras, this.#here);
  }

  show({ row, col }: Viewpoint): void {
    this.#here?.setAttribute("cx", String(col));
    this.#here?.setAttribute("cy", String(row));
    this.#drawing.setAttribute("aria-valuenow", String(Math.round(row * (this.#spans[1] + 1) + col)));
    this.#drawing.setAttribute("aria-valuetext", TEXTS.place(row, col));
  }

  #placeOf(event: PointerEvent): Viewpoint {
    const box = this.#drawing.getBoundingClientRect();
    const [rows, cols] = this.#spans;
    const at = (share: number, span: number) => share * (span + 2 * this.#margin) - this.#margin;
    return { row: at((event.clientY - box.top) / box.height, rows), col: at((event.clientX - box.left) / box.width, cols) };
  }
}
