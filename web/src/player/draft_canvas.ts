/** Drafts on a canvas of their own, which is as small as they are: the browser enlarges it, and no GPU has a part in it. */

import { element } from "./dom.ts";

export class DraftCanvas {
  readonly canvas = element("canvas", { class: "draft", "aria-hidden": "true", hidden: true });
  readonly #context = this.canvas.getContext("2d", { alpha: false })!;

  /** `pixels`: RGBA, rows from the top. */
  show(pixels: Uint8Array<ArrayBuffer>, width: number, height: number): void {
    const { canvas } = this;
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    this.#context.putImageData(new ImageData(new Uint8ClampedArray(pixels.buffer, pixels.byteOffset, pixels.length), width, height), 0, 0);
    canvas.hidden = false;
  }

  hide(): void {
    this.canvas.hidden = true;
  }
}
