/** `<mvcodec-player src view autoplay>`: the player as a custom element; the page is one with `page`. */

import { isLiveAddress } from "../container/live.ts";
import { BlobSource, HttpSource, type Source } from "../container/sources.ts";
import type { Viewpoint } from "../geometry.ts";
import type { Look } from "../synthesis/looks.ts";
import type { Pixels } from "../synthesis/renderer.ts";
import { element } from "./dom.ts";
import type { Eyes } from "./drawing.ts";
import type { Engine, EngineEvents } from "./engine.ts";
import { parseView } from "./format.ts";
import { PageEngine } from "./page_engine.ts";
import { ServerEngine } from "./server_engine.ts";
import type { Opening } from "./shown.ts";
import styles from "./style.css";
import { TEXTS } from "./texts.ts";
import { Ui } from "./ui.ts";

/** The detail of a `frame` event. */
export interface FrameDetail {
  readonly frame: number;
  readonly seconds: number;
  readonly view: Viewpoint;
}

/** The detail of an `error` event. */
export interface ErrorDetail {
  readonly message: string;
  /** Nothing more is shown. Otherwise it goes on, without what is damaged. */
  readonly isFatal: boolean;
}

/** What the player shows. */
export interface ShownState {
  readonly frame: number;
  readonly count: number;
  readonly view: Viewpoint;
  readonly look: Look;
  readonly dolly: number;
  readonly eyes: Eyes["mode"];
  /** What the left and the right eye see in a headset; null where there is none. */
  readonly immersed: readonly Viewpoint[] | null;
  readonly isPlaying: boolean;
  readonly speed: number;
  readonly section: { from: number; to: number } | null;
}

const SHEET = new CSSStyleSheet();
SHEET.replaceSync(styles);

export class MvcodecPlayer extends HTMLElement {
  static readonly observedAttributes = ["src", "view"];
  readonly #canvas = element("canvas", { class: "picture" });
  readonly #ui: Ui;
  #engine: Engine | undefined;
  #ready: Promise<void> | undefined;

  constructor() {
    super();
    const root = this.attachShadow({ mode: "open" });
    root.adoptedStyleSheets = [SHEET];
    this.#ui = new Ui(this, root, (from) => void this.open(from).catch(() => {}));
  }

  connectedCallback(): void {
    this.#ui.connect();
    if (this.#ready === undefined) this.#openFirst();
  }

  disconnectedCallback(): void {
    this.#ui.disconnect();
    this.#engine?.close();
    this.#engine = this.#ready = undefined;
  }

  attributeChangedCallback(name: string, before: string | null, value: string | null): void {
    // What stands there from the start is read with `connectedCallback`, which comes later.
    if (this.#ready === undefined || before === value || value === null) return;
    const view = parseView(value);
    if (name === "src") void this.open(value).catch(() => {});
    else if (view !== undefined && this.#engine?.isOpen) void this.look(view.row, view.col);
  }

  /** Resolves when the first picture is on the screen; rejects where there can be none. */
  get ready(): Promise<void> {
    return this.#ready ?? Promise.reject(new Error("no src"));
  }

  /** Show a file: its address, or one that the page has. Resolves as `ready` does. */
  open(from: string | Blob, at: Opening = {}): Promise<void> {
    const engine = this.#attach((events) => new PageEngine(this.#canvas, events));
    this.#ready = this.#start(engine, at, () => this.#read(engine, from, at));
    return this.#ready;
  }

  /** Show a frame, counted from 0; resolves when it is on the screen. */
  async seek(frame: number): Promise<void> {
    await this.ready;
    await this.#engine!.seek(frame);
  }

  /** Show a viewpoint, in steps of the array; resolves when it is on the screen. */
  async look(row: number, col: number): Promise<void> {
    await this.ready;
    this.#ui.endSway();
    await this.#engine!.look({ row, col });
  }

  /** Resolves when the picture stands, in full detail. Not while it plays, is held or is in a headset. */
  async settled(): Promise<void> {
    await this.ready;
    await this.#engine!.settled();
  }

  /** What is on the screen, and how it is played. Undefined before a file is open. */
  get shown(): ShownState | undefined {
    const engine = this.#engine;
    if (!engine?.isOpen) return undefined;
    const { look, dolly, eyes } = engine.shown;
    const { isPlaying, speed, section = null } = engine.playback;
    const { frame, count, view, immersed = null } = engine;
    return { frame, count, view, look, dolly, eyes: eyes.mode, immersed, isPlaying, speed, section };
  }

  play(): void {
    this.#engine?.play();
  }

  pause(): void {
    this.#engine?.pause();
  }

  /** The view that is shown, at picture size: as it stands or, not `fine`, as it moves. Throws Error before the first picture. */
  pixels(fine = true): Pixels {
    if (this.#engine === undefined) throw new Error("no picture yet");
    return this.#engine.pixels(fine);
  }

  #openFirst(): void {
    const isPage = this.hasAttribute("page");
    const asked = isPage ? new URLSearchParams(location.search) : new URLSearchParams();
    const server = this.getAttribute("server");
    const at = {
      seconds: Math.max(Number(asked.get("t") ?? 0) || 0, 0),
      view: parseView(asked.get("view") ?? this.getAttribute("view")),
      originals: asked.has("src") ? undefined : (this.getAttribute("originals") ?? undefined),
    };
    const embedded = isPage ? document.getElementById("recording") : null;
    const src = asked.get("src") ?? this.getAttribute("src");
    if (embedded !== null) void this.#openEmbedded(embedded.textContent ?? "", at).catch(() => {});
    else if (src !== null) void this.open(src, at).catch(() => {});
    else if (server !== null) void this.#serve(server, at).catch(() => {});
    else this.#ui.fail(TEXTS.noFile);
  }

  /** A recording that lies in the page itself, as base64. */
  async #openEmbedded(text: string, at: Opening): Promise<void> {
    const bytes = fetch(`data:application/octet-stream;base64,${text}`).then((answer) => answer.blob());
    this.#ready = bytes.then((blob) => this.open(blob, at));
    return this.#ready;
  }

  /** Show what a server renders; `address`: of its WebSocket. */
  #serve(address: string, at: Opening): Promise<void> {
    const engine = this.#attach((events) => new ServerEngine(new URL(address, location.href), events));
    this.#ready = this.#start(engine, at, () => engine.open(at));
    return this.#ready;
  }

  /** Put an engine in the place of the one that there is. */
  #attach<E extends Engine>(make: (events: EngineEvents) => E): E {
    this.#engine?.close();
    const engine: E = make({
      onFrame: () => {
        this.#ui.drawn();
        const detail: FrameDetail = { frame: engine.frame, seconds: engine.timeOf(engine.frame), view: engine.view };
        this.dispatchEvent(new CustomEvent("frame", { detail }));
      },
      onState: () => this.#ui.update(),
      onWaiting: (what) => this.#ui.wait(what),
      onTrouble: (message, isFatal) => this.#tell({ message, isFatal }),
    });
    this.#engine = engine;
    this.#ui.attach(engine);
    this.#ui.wait(TEXTS.waitingFile);
    return engine;
  }

  async #read(engine: PageEngine, from: string | Blob, at: Opening): Promise<void> {
    if (!("VideoDecoder" in globalThis)) throw new Error(TEXTS.noWebCodecs);
    const source: Source | string =
      typeof from !== "string" ? new BlobSource(from) : isLiveAddress(from) ? from : await HttpSource.open(from);
    await engine.open(source, at);
  }

  async #start(engine: Engine, at: Opening, open: () => Promise<void>): Promise<void> {
    try {
      await open();
    } catch (error) {
      if (engine === this.#engine) this.#tell({ message: (error as Error).message, isFatal: true });
      throw error;
    }
    if (engine !== this.#engine) return;
    this.#ui.opened(at.view !== undefined);
    if (this.hasAttribute("autoplay")) engine.play();
  }

  #tell(detail: ErrorDetail): void {
    this.#ui.wait(undefined);
    if (detail.isFatal) this.#ui.fail(detail.message);
    else this.#ui.tell(detail.message);
    this.dispatchEvent(new CustomEvent("error", { detail }));
  }
}
