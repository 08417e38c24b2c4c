/** What is under the pointer: its disparity and distance. */

import { depthOf } from "../geometry.ts";
import { element } from "./dom.ts";
import type { Engine } from "./engine.ts";
import { TEXTS } from "./texts.ts";

export class Probe {
  readonly label = element("p", { class: "probe", hidden: true });

  hide(): void {
    this.label.hidden = true;
  }

  /** Show it beside a place in the box that the picture stands in the middle of, in shares of the box. */
  show(engine: Engine, at: { x: number; y: number }, box: DOMRect): void {
    const { width, height } = engine.header;
    const scale = Math.min(box.width / width, box.height / height);
    const x = 0.5 + ((at.x - 0.5) * box.width) / (width * scale);
    const y = 0.5 + ((at.y - 0.5) * box.height) / (height * scale);
    const found = engine.probe(x, y);
    if (found === undefined) return;
    this.label.textContent = TEXTS.disparity(found.disparity, depthOf(engine.header, found.disparity));
    this.label.style.left = `${at.x * box.width + 14}px`;
    this.label.style.top = `${at.y * box.height + 14}px`;
    this.label.hidden = false;
  }
}
