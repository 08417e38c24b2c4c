/** Shows a recording by pictures that a server renders, which keeps the time too. */

import type { Codec, Header } from "../container/header.ts";
import { clampView, mostDolly, type Viewpoint } from "../geometry.ts";
import type { Look } from "../synthesis/looks.ts";
import type { Pixels } from "../synthesis/renderer.ts";
import { element } from "./dom.ts";
import type { Engine, EngineEvents, Place, Played } from "./engine.ts";
import type { Legend } from "./legend.ts";
import { pixelsOf } from "./originals.ts";
import { Rate } from "./rate.ts";
import type { Section } from "./section.ts";
import { ServerConnection, type Facts, type Hello } from "./server_connection.ts";
import { asAsked, keyOf, keyOfFacts, type Asked } from "./server_wishes.ts";
import { placed, shownFirst, type Opening, type Shown } from "./shown.ts";
import { serverStatistics } from "./statistics.ts";
import { TEXTS } from "./texts.ts";
import { Waiters } from "./waiters.ts";

export class ServerEngine implements Engine {
  readonly canvas = element("canvas", { class: "picture" });
  readonly shown: Shown = shownFirst();
  readonly isLight = false; // each view is a picture to be rendered and sent
  readonly isGrowing = false;
  readonly canImmerse = false;
  readonly immersed = undefined;
  isClosed = false;
  readonly #address: URL;
  readonly #events: EngineEvents;
  readonly #waiters = new Waiters();
  readonly #rate = new Rate();
  #connection: ServerConnection | undefined;
  #playback: Played = { isPlaying: false, speed: 1, section: undefined };
  #hello: Hello | undefined;
  #header: Header | undefined;
  /** Of the picture on the screen. */
  #facts: Facts | undefined;
  /** A frame is asked for that is not on the screen yet. */
  #isSeeking = false;
  /** What was said last of each kind: it is not said again. */
  readonly #said = new Map<string, string>();
  #tick: number | undefined;
  #drawing = Promise.resolve();
  /** Who asked what is seen somewhere, in the order of the answers. */
  #probes: ((place: Place | undefined) => void)[] = [];
  #peeked = 0;
  #peeking: Promise<unknown> = Promise.resolve();
  /** Damage that has been told, by its first frame. */
  readonly #damaged = new Set<number>();

  /** `address`: of the server's WebSocket. */
  constructor(address: URL, events: EngineEvents) {
    this.#address = address;
    this.#events = events;
  }

  async open(at: Opening = {}): Promise<void> {
    const socket = new URL(this.#address);
    socket.protocol = socket.protocol === "https:" ? "wss:" : "ws:";
    this.#connection = new ServerConnection(socket.href, {
      onSaid: (message) => {
        if (message.type === "hello") this.#greet(message, at);
        else if (message.type === "state") this.#state(message.playing);
        else if (message.type === "trouble") this.#trouble(message.message);
        else this.#place(message.disparity_px, message.depth_m);
      },
      onPicture: (facts, jpeg) => {
        // One after the other: two bitmaps decoded at once may be done in the wrong order.
        this.#drawing = this.#drawing.then(() => this.#draw(facts, jpeg));
      },
      onAway: (reason) => this.#events.onWaiting(reason),
    });
    await this.#waiters.until(() => this.#facts !== undefined);
  }

  close(): void {
    this.isClosed = true;
    this.#connection?.close();
    if (this.#tick !== undefined) cancelAnimationFrame(this.#tick);
    this.#waiters.releaseAll();
  }

  get isOpen(): boolean {
    return this.#facts !== undefined;
  }

  get header(): Header {
    if (this.#header === undefined) throw new Error("no file is open");
    return this.#header;
  }

  get count(): number {
    return this.#hello?.times_s.length ?? 0;
  }

  get looks(): readonly Look[] {
    return (this.#hello?.looks ?? []) as readonly Look[];
  }

  get enhanced(): readonly (readonly [number, number])[] {
    return this.#hello?.enhanced ?? [];
  }

  get playback(): Played {
    return this.#playback;
  }

  get frame(): number {
    return this.#facts?.frame ?? 0;
  }

  get view(): Viewpoint {
    return placed(this.shown).view;
  }

  get legend(): Legend {
    const { legend = null, quality = null } = this.#facts ?? {};
    const told = quality === null ? "" : quality.psnr_db === null ? (quality.reason ?? "") : TEXTS.quality(quality.psnr_db, quality.ssim);
    const text = [legend?.text ?? "", told].filter(Boolean).join(". ");
    const { low, high, colours, items } = legend ?? {};
    return {
      text,
      ...(low !== undefined && high !== undefined && colours !== undefined && { scale: { low, high, colours } }),
      ...(items !== undefined && { classes: items }),
    };
  }

  get statistics(): string {
    return serverStatistics(this, this.#hello!.synthesizer, this.#rate.perSecond, this.#facts!);
  }

  timeOf(frame: number): number {
    return this.#hello?.times_s[frame] ?? 0;
  }

  frameAt(seconds: number): number {
    const found = this.#hello?.times_s.findLastIndex((time) => time <= seconds + 1e-6) ?? 0;
    return Math.max(found, 0);
  }

  seek(frame: number): Promise<void> {
    this.shown.frame = Math.min(Math.max(Math.round(frame) || 0, 0), Math.max(this.count - 1, 0));
    this.#isSeeking = !this.#playback.isPlaying && this.shown.frame !== this.frame;
    this.#connection?.send("seek", { frame: this.shown.frame });
    return this.#until(false);
  }

  look(view: Viewpoint): Promise<void> {
    this.shown.view = clampView(this.header, view);
    this.#say();
    return this.#until(false);
  }

  change(what: Partial<Omit<Shown, "frame" | "view">>): Promise<void> {
    Object.assign(this.shown, what);
    this.#say();
    return this.#until(false);
  }

  settled(): Promise<void> {
    return this.#until(true);
  }

  play(): void {
    if (this.count > 1) this.#play(true);
  }

  pause(): void {
    this.#play(false);
  }

  setSpeed(speed: number): void {
    this.#playback = { ...this.#playback, speed };
    this.#connection?.send("speed", { factor: speed });
    this.#events.onState();
  }

  setSection(section: Section | undefined): void {
    this.#playback = { ...this.#playback, section };
    const { from, to } = section ?? { from: 0, to: Infinity };
    this.#connection?.send("section", { first: this.frameAt(from), last: this.frameAt(to) });
    this.#events.onState();
  }

  hold(): void {} // the server makes whole pictures when nothing has moved for a while

  record(): void {} // all of it is there

  /** As it came, with what JPEG does to it. */
  pixels(): Pixels {
    const context = this.canvas.getContext("2d");
    if (context === null || this.#facts === undefined) throw new Error("no picture yet");
    const { width, height } = this.canvas;
    const { data } = context.getImageData(0, 0, width, height);
    return { width, height, data: new Uint8Array(data.buffer) };
  }

  async probe(x: number, y: number): Promise<Place | undefined> {
    const { eyes, focus } = placed(this.shown);
    if (eyes.mode !== "one" || focus !== undefined || Math.min(x, y) < 0 || Math.max(x, y) > 1) return undefined;
    this.#connection?.send("probe", { x, y });
    return new Promise((resolve) => this.#probes.push(resolve));
  }

  async peek(seconds: number): Promise<ImageData | undefined> {
    const number = ++this.#peeked;
    await this.#peeking;
    if (number !== this.#peeked) return undefined; // the pointer is elsewhere by now
    const { row, col } = this.shown.view;
    const address = new URL(`thumbnail/${this.frameAt(seconds)}?row=${row}&col=${col}`, this.#address);
    const found = fetch(address).then(async (answer) => (answer.ok ? pixelsOf(await answer.blob()) : undefined)).catch(() => undefined);
    this.#peeking = found;
    return found;
  }

  async immerse(): Promise<void> {
    throw new Error(TEXTS.noHeadsetHere);
  }

  leave(): void {}

  #greet(hello: Hello, at: Opening): void {
    const isFirst = this.#hello === undefined;
    this.#hello = hello;
    this.#header = headerOf(hello);
    const { rows, cols } = hello;
    if (isFirst) {
      this.shown.view = clampView(this.header, at.view ?? { row: (rows - 1) / 2, col: (cols - 1) / 2 });
      this.shown.frame = this.frameAt(at.seconds ?? 0);
      this.shown.eyes = { ...this.shown.eyes, distance: Math.min(0.5, cols - 1) };
    }
    this.#said.clear();
    this.#probes.splice(0).forEach((tell) => tell(undefined));
    const connection = this.#connection!;
    this.#sayNow();
    connection.send("seek", { frame: this.shown.frame });
    connection.send("loop", { loop: true });
    this.setSpeed(this.#playback.speed);
    this.setSection(this.#playback.section);
    if (this.#playback.isPlaying) connection.send("play", { playing: true });
    connection.send("ready");
    if (hello.cut_off !== null) this.#events.onTrouble(hello.cut_off, false);
    this.#events.onWaiting(isFirst ? TEXTS.waitingPicture : undefined);
  }

  /** Before the next picture of the screen, however much is asked for until then. */
  #say(): void {
    this.#tick ??= requestAnimationFrame(() => {
      this.#tick = undefined;
      this.#sayNow();
    });
  }

  #sayNow(): void {
    const { shown } = this;
    const wishes: Record<string, Record<string, unknown>> = {
      move: { row: shown.view.row, col: shown.view.col },
      show: { look: shown.look },
      eyes: { mode: shown.eyes.mode, steps: shown.eyes.distance },
      dolly: { share: this.#asked.dolly },
      focus: { px: shown.focus ?? null },
      wipe: { share: shown.wipe },
    };
    for (const [type, fields] of Object.entries(wishes)) {
      const text = JSON.stringify(fields);
      if (this.#said.get(type) === text) continue;
      this.#said.set(type, text);
      this.#connection?.send(type, fields);
    }
  }

  get #asked(): Asked {
    return asAsked(this.shown, this.header.cols, mostDolly(this.header));
  }

  async #draw(facts: Facts, jpeg: Blob): Promise<void> {
    try {
      const bitmap = await createImageBitmap(jpeg);
      if (this.isClosed) return bitmap.close();
      const { canvas } = this;
      if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) [canvas.width, canvas.height] = [bitmap.width, bitmap.height];
      canvas.getContext("2d", { alpha: false })!.drawImage(bitmap, 0, 0);
      bitmap.close();
    } catch (error) {
      // The next one is drawn all the same, and the server waits for no answer about this one.
      this.#connection?.send("shown", { picture: facts.picture });
      this.#events.onTrouble(TEXTS.notDrawn(facts.frame, (error as Error).message), false);
      return;
    }
    this.#connection?.send("shown", { picture: facts.picture });
    this.#rate.note(performance.now());
    this.#facts = facts;
    if (this.#isSeeking && facts.frame === this.shown.frame) this.#isSeeking = false;
    if (!this.#isSeeking) this.shown.frame = facts.frame;
    this.#tellDamage(facts);
    this.#events.onFrame();
    this.#waiters.look();
  }

  #tellDamage({ damage, frame }: Facts): void {
    if (damage === null || this.#damaged.has(damage.first)) return;
    this.#damaged.add(damage.first);
    this.#events.onTrouble(TEXTS.damage(frame, damage.time_s, damage.goes_on_s, damage.message), false);
  }

  #until(isWhole: boolean): Promise<void> {
    const { view } = this.shown;
    const waiting = this.#waiters.until(() => {
      if (view !== this.shown.view && !isWhole) return true; // a later goal replaces this one
      const facts = this.#facts;
      if (facts === undefined || keyOfFacts(facts) !== keyOf(this.#asked) || this.#isSeeking) return false;
      return !isWhole || (facts.scale === 1 && !facts.quick);
    });
    this.#waiters.look(); // it may be there already, and no other picture comes then
    return waiting;
  }

  #play(isPlaying: boolean): void {
    this.#isSeeking = false;
    this.#connection?.send("play", { playing: isPlaying });
    this.#state(isPlaying);
  }

  #state(isPlaying: boolean): void {
    this.#playback = { ...this.#playback, isPlaying };
    this.#events.onState();
  }

  #place(disparity: number | null, metres: number | null): void {
    this.#probes.shift()?.(disparity === null ? undefined : { disparity, metres: metres ?? undefined });
  }

  #trouble(text: string): void {
    this.#events.onTrouble(text, false);
    this.#waiters.releaseAll();
  }
}

/** A file as the server shows it: from between all its cameras, however they are coded. */
function headerOf(hello: Hello): Header {
  return {
    codec: hello.codec as Codec, rows: hello.rows, cols: hello.cols, width: hello.width, height: hello.height, fps: hello.fps,
    realRows: hello.real_rows, realCols: hello.real_cols, rho: hello.rho, name: hello.title.replace(/\.mcap$/, ""),
    calibration: { fx: 1, fy: 1, baselineM: 1, dInf: hello.infinity_px_per_step, given: false },
    range: hello.range_px, mapScale: 1, mapCameras: "all", predicted: [], enhancedViews: 0, document: undefined,
  };
}
