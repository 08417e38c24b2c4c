/** `<mvcodec-player src view autoplay>`: the player as a custom element. */

import { BlobSource, HttpSource, type Source } from "../container/sources.ts";
import type { Viewpoint } from "../geometry.ts";
import type { Pixels } from "../synthesis/renderer.ts";
import { Engine } from "./engine.ts";

export class MvcodecPlayer extends HTMLElement {
  static readonly observedAttributes = ["src", "view"];
  readonly canvas = document.createElement("canvas");
  #engine: Engine | undefined;
  #ready: Promise<void> | undefined;

  constructor() {
    super();
    this.attachShadow({ mode: "open" }).append(this.canvas);
  }

  connectedCallback(): void {
    if (this.#ready !== undefined) return;
    const embedded = this.hasAttribute("page") ? document.getElementById("recording") : null;
    const src = this.getAttribute("src");
    if (embedded !== null) void this.#openEmbedded(embedded.textContent ?? "").catch(() => {});
    else if (src !== null) void this.open(src).catch(() => {});
  }

  /** A recording that lies in the page itself, as base64. */
  async #openEmbedded(text: string): Promise<void> {
    const answer = await fetch(`data:application/octet-stream;base64,${text}`);
    return this.open(await answer.blob());
  }

  /** Resolves when the first picture is on the screen. */
  get ready(): Promise<void> {
    return this.#ready ?? Promise.reject(new Error("no src"));
  }

  get engine(): Engine | undefined {
    return this.#engine;
  }

  open(from: string | Blob): Promise<void> {
    this.#engine?.close();
    const engine = new Engine(this.canvas, {
      onFrame: () => this.dispatchEvent(new CustomEvent("frame", { detail: { frame: engine.frame, view: engine.shown.view } })),
      onState: () => {},
      onWaiting: () => {},
      onTrouble: (text, isFatal) => this.dispatchEvent(new CustomEvent("error", { detail: { message: text, isFatal } })),
    });
    this.#engine = engine;
    const source: Promise<Source> = typeof from === "string" ? HttpSource.open(from) : Promise.resolve(new BlobSource(from));
    this.#ready = source.then((bytes) => engine.open(bytes));
    return this.#ready;
  }

  seek(frame: number): Promise<void> {
    return this.#engine!.seek(frame);
  }

  look(row: number, col: number): Promise<void> {
    return this.#engine!.look({ row, col } satisfies Viewpoint);
  }

  pixels(): Pixels {
    return this.#engine!.pixels();
  }
}
