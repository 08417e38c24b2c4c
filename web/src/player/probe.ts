/** What is under the pointer: its disparity and distance. */

import { element } from "./dom.ts";
import type { Engine } from "./engine.ts";
import { TEXTS } from "./texts.ts";

export class Probe {
  readonly label = element("p", { class: "probe", hidden: true });

  #asked = 0;

  hide(): void {
    this.#asked++;
    this.label.hidden = true;
  }

  /** Show it beside a place in the box that the picture stands in the middle of, in shares of the box. */
  async show(engine: Engine, at: { x: number; y: number }, box: DOMRect): Promise<void> {
    const number = ++this.#asked;
    const { width, height } = engine.header;
    const scale = Math.min(box.width / width, box.height / height);
    const x = 0.5 + ((at.x - 0.5) * box.width) / (width * scale);
    const y = 0.5 + ((at.y - 0.5) * box.height) / (height * scale);
    const found = await engine.probe(x, y);
    if (number !== this.#asked) return;
    this.label.hidden = found === undefined;
    if (found === undefined) return;
    this.label.textContent = TEXTS.disparity(found.disparity, found.metres);
    this.label.style.left = `${at.x * box.width + 14}px`;
    this.label.style.top = `${at.y * box.height + 14}px`;
  }
}
