/** Shows a recording by itself: the page decodes it, and draws a frame or a viewpoint when they change and not otherwise. */

import type { Header } from "../container/header.ts";
import { LiveRecording } from "../container/live.ts";
import { openRecording } from "../container/open.ts";
import { frameAt, frameCount, timeOf, type Recording } from "../container/recording.ts";
import type { Source } from "../container/sources.ts";
import { camerasOf, clampView, type Viewpoint } from "../geometry.ts";
import { LOOKS, type Look } from "../synthesis/looks.ts";
import type { Pixels } from "../synthesis/renderer.ts";
import { viewsShown } from "./drawing.ts";
import type { Engine, EngineEvents, Place } from "./engine.ts";
import { Immersive, type Due } from "./immersive.ts";
import { legendOf, type Legend } from "./legend.ts";
import { Originals } from "./originals.ts";
import { Painting } from "./painting.ts";
import { Playback } from "./playback.ts";
import type { Section } from "./section.ts";
import { placed, shownFirst, type Opening, type Shown } from "./shown.ts";
import { pageStatistics } from "./statistics.ts";
import { Supply, type Decoded } from "./supply.ts";
import { TEXTS } from "./texts.ts";
import { Waiters } from "./waiters.ts";

/** Width of the small pictures of the bar, px. */
const PEEK_PX = 160;

export class PageEngine implements Engine {
  readonly canvas: HTMLCanvasElement;
  readonly shown: Shown = shownFirst();
  readonly playback = new Playback();
  readonly isLight = true;
  readonly canImmerse = true;
  readonly enhanced = []; // they are shown as synthesised
  isClosed = false;
  readonly #events: EngineEvents;
  #source: Source | undefined;
  #recording: Recording | undefined;
  #supply: Supply | undefined;
  #painting: Painting | undefined;
  #immersive: Immersive | undefined;
  #hasOriginals = false;
  /** The newest frame of a live view. */
  #liveFrame: number | undefined;
  #isDirty = false;
  #tick: number | undefined;
  readonly #waiters = new Waiters();

  constructor(canvas: HTMLCanvasElement, events: EngineEvents) {
    this.canvas = canvas;
    this.#events = events;
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.#immersive?.end();
    });
    canvas.addEventListener("webglcontextrestored", () => this.#restore());
  }

  /** Read a file, or follow the live view at an address, and show it from some seconds on. Throws Error. */
  async open(source: Source | string, at: Opening = {}): Promise<void> {
    const tell = (text: string) => this.#events.onTrouble(text, false);
    const onGrowth = () => this.#grown();
    const recording = typeof source === "string"
      ? await LiveRecording.open(source, tell, onGrowth)
      : await openRecording(source, { fromSeconds: at.seconds ?? 0, tell, onGrowth });
    if (this.isClosed) return recording.close();
    if (typeof source === "string") this.#liveFrame = 0;
    else this.#source = source;
    this.#recording = recording;
    this.#supply = new Supply(recording, {
      isWanted: (frame) => this.shown.frame === frame,
      isPlaying: () => this.playback.isPlaying,
      onDecoded: () => {
        if (this.#immersive !== undefined) this.#events.onFrame();
        this.wake();
      },
      onMissing: (frame) => (this.shown.frame = frame + 1),
      onWaiting: (isWaiting) => this.#events.onWaiting(isWaiting ? TEXTS.waitingPicture : undefined),
      onTrouble: (text, isFatal) => this.#trouble(text, isFatal),
    });
    const { header } = recording;
    const onCame = (trouble?: string) => (trouble === undefined ? undefined : tell(trouble), this.wake());
    const originals = at.originals === undefined ? undefined : new Originals(at.originals, header, onCame);
    this.#hasOriginals = originals !== undefined;
    this.#painting = new Painting(this.canvas, header, originals, this);
    this.shown.frame = frameAt(recording.spans, at.seconds ?? 0);
    this.shown.view = clampView(header, at.view ?? { row: (header.rows - 1) / 2, col: (header.cols - 1) / 2 });
    this.playback.setEnd(timeOf(recording.spans, this.count - 1) + 1 / header.fps);
    await this.#settled();
  }

  close(): void {
    this.isClosed = true;
    this.playback.pause();
    if (this.#tick !== undefined) cancelAnimationFrame(this.#tick);
    this.#immersive?.end();
    this.#painting?.close();
    this.#recording?.close();
    this.#supply?.close();
    this.#waiters.releaseAll();
  }

  get isOpen(): boolean {
    return this.#recording !== undefined;
  }

  /** Throws Error before a file is open. */
  get header(): Header {
    if (this.#recording === undefined) throw new Error("no file is open");
    return this.#recording.header;
  }

  get count(): number {
    return this.#recording === undefined ? 0 : frameCount(this.#recording);
  }

  get isGrowing(): boolean {
    return this.#recording?.growing ?? false;
  }

  get looks(): readonly Look[] {
    return LOOKS.filter((look) => look !== "difference" || this.#hasOriginals);
  }

  get legend(): Legend {
    return legendOf(this.shown.look, this.header.range, this.#painting?.psnr);
  }

  get statistics(): string {
    const { requests, bytes } = this.#source?.traffic ?? { requests: 0, bytes: 0 };
    const { interval, detail } = this.#painting!.tempo;
    return pageStatistics(this, { interval, detail, decodeMs: this.#supply?.decodeMs ?? 0, requests, bytes });
  }

  /** What there is to be drawn; undefined before the first frame. */
  get decoded(): Decoded | undefined {
    return this.#supply?.decoded;
  }

  /** From one frame to the next while it plays, ms; else 0. */
  get framePeriodMs(): number {
    return this.playback.isPlaying ? 1000 / (this.header.fps * this.playback.speed) : 0;
  }

  onMeasured(): void {
    this.#events.onState();
  }

  get view(): Viewpoint {
    return placed(this.shown).view;
  }

  get frame(): number {
    return this.decoded?.frame ?? 0;
  }

  get immersed(): readonly Viewpoint[] | undefined {
    return this.#immersive?.views;
  }

  timeOf(frame: number): number {
    return this.#recording === undefined ? 0 : timeOf(this.#recording.spans, frame);
  }

  frameAt(seconds: number): number {
    return this.#recording === undefined ? 0 : frameAt(this.#recording.spans, seconds);
  }

  seek(frame: number): Promise<void> {
    this.shown.frame = Math.min(Math.max(Math.round(frame) || 0, 0), Math.max(this.count - 1, 0));
    this.playback.moveTo(this.timeOf(this.shown.frame));
    return this.#settled();
  }

  look(view: Viewpoint): Promise<void> {
    this.shown.view = clampView(this.header, view);
    return this.#settled();
  }

  change(what: Partial<Omit<Shown, "frame" | "view">>): Promise<void> {
    Object.assign(this.shown, what);
    return this.#settled();
  }

  async settled(): Promise<void> {
    await this.#settled();
    const isDone = () => this.#painting?.isFinal === true && !this.#isDirty && this.decoded?.frame === this.shown.frame;
    const standing = this.#waiters.until(isDone);
    this.#painting?.moved();
    this.wake();
    await standing;
  }

  play(): void {
    if (this.#recording === undefined || this.count < 2) return;
    this.playback.play(this.timeOf(this.shown.frame));
    this.#events.onState();
    this.wake();
  }

  pause(): void {
    this.playback.pause();
    this.#events.onState();
    this.wake();
  }

  setSpeed(speed: number): void {
    this.playback.setSpeed(speed);
    this.#events.onState();
  }

  setSection(section: Section | undefined): void {
    this.playback.section = section;
    this.#events.onState();
  }

  pixels(fine = true): Pixels {
    if (this.#painting === undefined || this.decoded === undefined) throw new Error("no picture yet");
    return this.#painting.pixels(fine, this.#immersive === undefined);
  }

  async probe(x: number, y: number): Promise<Place | undefined> {
    return this.#painting?.probe(x, y);
  }

  async peek(seconds: number): Promise<ImageData | undefined> {
    return this.#supply?.peek(this.shown.view, seconds, PEEK_PX);
  }

  hold(isHeld: boolean): void {
    this.#painting?.hold(isHeld);
  }

  record(isRecorded: boolean): void {
    if (this.#painting !== undefined) this.#painting.isRecorded = isRecorded;
  }

  async immerse(): Promise<void> {
    if (this.#painting === undefined) throw new Error("no file is open");
    const due = (now: number, views: readonly Viewpoint[]) => this.#due(now, views);
    const started = await Immersive.start(this.#painting.renderer, this.header, this.shown.view, due, () => this.#left());
    if (this.isClosed) started.end();
    else this.#immersive = started;
    this.#events.onState();
  }

  leave(): void {
    this.#immersive?.end();
  }

  /** Look whether there is something to do, with the next picture of the screen. */
  wake(): void {
    this.#isDirty = true;
    this.#schedule();
  }

  #schedule(): void {
    if (this.#tick === undefined && !this.isClosed && this.#immersive === undefined) this.#tick = requestAnimationFrame((now) => this.#run(now));
  }

  async #settled(): Promise<void> {
    const { view } = this.shown;
    this.wake();
    // A later goal replaces this one.
    const isDone = () => view !== this.shown.view || (this.decoded?.frame === this.shown.frame && !this.#isDirty);
    await this.#waiters.until(isDone);
  }

  #run(now: number): void {
    this.#tick = undefined;
    if (this.#immersive !== undefined) return;
    this.#playOn(now);
    const painting = this.#painting;
    // While the next frame is decoded, the one that is there can be seen from elsewhere.
    const isReady = (this.isOpen && this.#fetch(viewsShown(this.header, placed(this.shown)))) || painting?.isMoved;
    if (painting !== undefined && isReady && painting.prepare() && this.#isDirty && this.decoded !== undefined) {
      this.#isDirty = false;
      painting.paint(now);
      this.#events.onFrame();
      painting.moved();
    }
    this.#waiters.look();
    if (this.playback.isPlaying) this.#schedule();
  }

  /** What is to be drawn for a headset, whose own clock comes in place of the screen's. */
  #due(now: number, views: readonly Viewpoint[]): Due {
    this.#playOn(now);
    if (this.#fetch(views)) this.#isDirty = false;
    const { tempo } = this.#painting!;
    tempo.drawn(now, 0);
    this.#waiters.look();
    return { frames: this.decoded?.frames, shown: this.shown, detail: tempo.detail };
  }

  /** The headset is off: the screen shows the picture again. */
  #left(): void {
    this.#immersive = undefined;
    this.#painting?.tempo.rest();
    this.#events.onState();
    this.wake();
  }

  #playOn(now: number): void {
    const { playback } = this;
    if (!playback.isPlaying) return;
    const frame = this.frameAt(playback.timeAt(now));
    this.#isDirty ||= frame !== this.shown.frame;
    this.shown.frame = frame;
    if (!playback.isPlaying) this.#events.onState();
  }

  /** Whether what some views need of the frame that is due is decoded; begins to decode it where it is not. */
  #fetch(views: readonly Viewpoint[]): boolean {
    return this.#supply?.fetch(this.shown.frame, camerasOf(this.header, views)) ?? false;
  }

  #trouble(text: string, isFatal: boolean): void {
    if (isFatal) this.playback.pause();
    this.#events.onTrouble(text, isFatal);
    if (isFatal) this.#waiters.releaseAll();
  }

  #grown(): void {
    if (this.#liveFrame !== undefined) {
      // Whoever is at the newest picture stays there.
      if (this.shown.frame === this.#liveFrame) this.shown.frame = this.count - 1;
      this.#liveFrame = this.count - 1;
    }
    this.playback.setEnd(this.timeOf(this.count - 1) + 1 / this.header.fps);
    this.#events.onState();
    this.wake();
  }

  #restore(): void {
    if (this.isClosed) return;
    this.#painting?.restore();
    this.wake();
  }
}
