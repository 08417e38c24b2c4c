/** Files that somebody drops on the player, or chooses. */

import { element } from "./dom.ts";

export class Incoming {
  readonly input = element("input", { type: "file", accept: ".mcap", hidden: true });
  readonly #open: (file: Blob) => void;

  constructor(open: (file: Blob) => void) {
    this.#open = open;
  }

  listen(host: HTMLElement, signal: AbortSignal): void {
    host.addEventListener("dragover", (event) => event.preventDefault(), { signal });
    host.addEventListener("drop", (event) => {
      event.preventDefault();
      this.#take(event.dataTransfer?.files);
    }, { signal });
    this.input.addEventListener("change", () => this.#take(this.input.files), { signal });
  }

  #take(files: FileList | null | undefined): void {
    const [file] = files ?? [];
    if (file !== undefined) this.#open(file);
  }
}
