/** What is shown: a recording, a frame and a viewpoint, drawn when they change and not otherwise. */

import type { Header } from "../container/header.ts";
import { topicOf } from "../container/messages.ts";
import { LiveRecording } from "../container/live.ts";
import { openRecording } from "../container/open.ts";
import { frameAt, frameCount, keySpanAt, timeOf, type Recording } from "../container/recording.ts";
import type { Source } from "../container/sources.ts";
import { FrameStore } from "../decode/frame_store.ts";
import { smallPicture } from "../decode/planes.ts";
import { clampView, contributors, infinityOf, nearestCamera, type Camera, type Viewpoint } from "../geometry.ts";
import type { CameraFrame } from "../synthesis/camera_textures.ts";
import { ViewRenderer, type Pixels } from "../synthesis/renderer.ts";
import { apertureOf, drawShown, eyesOf } from "./drawing.ts";
import { Playback } from "./playback.ts";
import type { Shown } from "./shown.ts";
import { Tempo } from "./tempo.ts";

/** Told to whoever shows the controls. */
export interface EngineEvents {
  /** Another picture is on the screen. */
  onFrame(): void;
  /** Playback, loop or the file's length changed. */
  onState(): void;
  /** A picture has been waited for a while; false: it has come. */
  onWaiting(isWaiting: boolean): void;
  /** Something is wrong with the file; it goes on where `isFatal` is false. */
  onTrouble(text: string, isFatal: boolean): void;
}

interface Decoded {
  readonly frame: number;
  readonly frames: readonly CameraFrame[];
  /** The cameras that were asked for. */
  readonly asked: string;
}

/** A picture that takes longer is waited for visibly. */
const WAITING_MS = 250;
/** Frames that are decoded ahead while playing. */
const PREFETCH = 4;
/** 1 - 1 / the most that what is nearest is enlarged by. */
const MOST_DOLLY = 0.2;
/** The picture stands when nothing has changed for so long. */
const STANDS_MS = 120;

export class Engine {
  readonly shown: Shown = { frame: 0, view: { row: 0, col: 0 }, look: "picture", dolly: 0, eyes: { mode: "one", distance: 0.5 }, wipe: 0, focus: undefined };
  readonly playback = new Playback();
  readonly tempo = new Tempo();
  readonly #canvas: HTMLCanvasElement;
  readonly #events: EngineEvents;
  #source: Source | undefined;
  #recording: Recording | undefined;
  #store: FrameStore | undefined;
  #renderer: ViewRenderer | undefined;
  #decoded: Decoded | undefined;
  #peeks: FrameStore | undefined;
  #peeked = 0;
  /** How long the last frame took to decode. */
  decodeMs = 0;
  #isFetching = false;
  /** The newest frame of a live view. */
  #liveFrame: number | undefined;
  #isDirty = false;
  /** What is on the screen has all detail; what is drawn next is to have it. */
  #isFinal = false;
  #isFinalDue = false;
  #drawnView: Viewpoint | undefined;
  #tick: number | undefined;
  #stands: ReturnType<typeof setTimeout> | undefined;
  #waiters: { isDone: () => boolean; resolve: () => void }[] = [];
  isClosed = false;

  constructor(canvas: HTMLCanvasElement, events: EngineEvents) {
    this.#canvas = canvas;
    this.#events = events;
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => this.#restore());
  }

  /** Read a file, or follow the live view at an address, and show it from some seconds on; the view is the array's middle unless one is given. Throws Error. */
  async open(source: Source | string, at: { seconds?: number; view?: Viewpoint | undefined } = {}): Promise<void> {
    const tell = (text: string) => this.#events.onTrouble(text, false);
    const onGrowth = () => this.#grown();
    const recording = typeof source === "string"
      ? await LiveRecording.open(source, tell, onGrowth)
      : await openRecording(source, { fromSeconds: at.seconds ?? 0, tell, onGrowth });
    if (this.isClosed) return recording.close();
    if (typeof source === "string") this.#liveFrame = 0;
    else this.#source = source;
    this.#recording = recording;
    this.#store = new FrameStore(recording, (text) => this.#events.onTrouble(text, false));
    const { header } = recording;
    this.#renderer = new ViewRenderer(this.#canvas, header);
    this.shown.frame = frameAt(recording.spans, at.seconds ?? 0);
    this.shown.view = clampView(header, at.view ?? { row: (header.rows - 1) / 2, col: (header.cols - 1) / 2 });
    this.playback.setEnd(timeOf(recording.spans, this.count - 1) + 1 / header.fps);
    await this.#settled();
  }

  close(): void {
    this.isClosed = true;
    this.playback.pause();
    if (this.#tick !== undefined) cancelAnimationFrame(this.#tick);
    clearTimeout(this.#stands);
    this.#recording?.close();
    this.#store?.close();
    this.#peeks?.close();
    this.#waiters.splice(0).forEach(({ resolve }) => resolve());
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

  get traffic(): { requests: number; bytes: number } {
    return this.#source?.traffic ?? { requests: 0, bytes: 0 };
  }

  /** The frame that is on the screen. */
  get frame(): number {
    return this.#decoded?.frame ?? 0;
  }

  timeOf(frame: number): number {
    return this.#recording === undefined ? 0 : timeOf(this.#recording.spans, frame);
  }

  frameAt(seconds: number): number {
    return this.#recording === undefined ? 0 : frameAt(this.#recording.spans, seconds);
  }

  /** Show a frame; resolves when it is on the screen. */
  seek(frame: number): Promise<void> {
    this.shown.frame = Math.min(Math.max(Math.round(frame) || 0, 0), Math.max(this.count - 1, 0));
    this.playback.moveTo(this.timeOf(this.shown.frame));
    return this.#settled();
  }

  /** Show a viewpoint; resolves when it is on the screen. */
  look(view: Viewpoint): Promise<void> {
    this.shown.view = clampView(this.header, view);
    return this.#settled();
  }

  /** Change how it is shown. */
  change(what: Partial<Omit<Shown, "frame" | "view">>): Promise<void> {
    Object.assign(this.shown, what);
    return this.#settled();
  }

  /** Resolves when what is asked for is on the screen, with all detail. */
  async settled(): Promise<void> {
    await this.#settled();
    await new Promise<void>((resolve) => {
      const isDone = () => this.#isFinal && !this.#isDirty && this.#decoded?.frame === this.shown.frame;
      this.#waiters.push({ isDone, resolve });
      this.#standsSoon();
      this.wake();
    });
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

  /** The view that is shown, at picture size, whatever the screen shows of it: as it stands or, not `fine`, as it moves. Throws Error before the first picture. */
  pixels(fine = true): Pixels {
    if (this.#renderer === undefined || this.#decoded === undefined) throw new Error("no picture yet");
    const { view, look, dolly } = this.shown;
    const pixels = this.#renderer.read(this.#decoded.frames, view, { look, fine, dolly });
    this.#draw(true); // the canvas may have lost what it showed
    return pixels;
  }

  /** What is seen at a place of the picture, from its upper left in shares of its size. */
  probe(x: number, y: number): { disparity: number; isSeen: boolean } | undefined {
    if (this.#renderer === undefined || this.#decoded === undefined || this.shown.eyes.mode !== "one") return undefined;
    const { width, height } = this.header;
    const { view, look, dolly } = this.shown;
    const [column, row] = [Math.floor(x * width), Math.floor(y * height)];
    if (column < 0 || row < 0 || column >= width || row >= height) return undefined;
    return this.#renderer.probe(this.#decoded.frames, view, { look, dolly, fine: false }, column, row);
  }

  /** A small picture of a time, from the nearest camera and keyframe; undefined where it is damaged. */
  async peek(seconds: number, width: number): Promise<ImageData | undefined> {
    if (this.#recording === undefined) return undefined;
    const { spans } = this.#recording;
    this.#peeks ??= new FrameStore(this.#recording, () => {}); // its decoders do not disturb those that play
    const frame = keySpanAt(spans, frameAt(spans, seconds)).first;
    const topic = topicOf(nearestCamera(this.header, this.shown.view), "video");
    const number = ++this.#peeked;
    const planes = await this.#peeks.planes(topic, frame, () => number === this.#peeked);
    return planes && smallPicture(planes, width);
  }

  /** The limit of `dolly`: what is nearest is enlarged by a quarter at most, which keeps holes few. */
  get mostDolly(): number {
    return MOST_DOLLY / Math.max(this.header.range[1] - infinityOf(this.header), 1e-3);
  }

  /** Look whether there is something to do, with the next picture of the screen. */
  wake(): void {
    this.#isDirty = true;
    if (this.#tick === undefined && !this.isClosed) this.#tick = requestAnimationFrame((now) => this.#run(now));
  }

  async #settled(): Promise<void> {
    const goal = { frame: this.shown.frame, view: this.shown.view };
    this.wake();
    await new Promise<void>((resolve) => {
      // A later goal replaces this one.
      const isDone = () =>
        goal.view !== this.shown.view || (this.#decoded !== undefined && this.#decoded.frame === this.shown.frame && !this.#isDirty);
      this.#waiters.push({ isDone, resolve });
    });
  }

  #run(now: number): void {
    this.#tick = undefined;
    const { playback } = this;
    if (playback.isPlaying) {
      this.shown.frame = this.frameAt(playback.timeAt(now));
      if (!playback.isPlaying) this.#events.onState();
    }
    // While the next frame is decoded, the one that is there can be seen from elsewhere.
    const isReady = this.#fetch() || this.#drawnView !== this.shown.view;
    if (isReady && this.#isDirty && this.#decoded !== undefined) {
      this.#isDirty = false;
      const isFinal = this.#isFinalDue || this.tempo.isQuick;
      this.#isFinalDue = false;
      this.#draw(isFinal);
      if (!isFinal) this.tempo.drawn(now);
      this.#events.onFrame();
      this.#standsSoon();
    }
    this.#waiters = this.#waiters.filter(({ isDone, resolve }) => !isDone() || void resolve());
    if (playback.isPlaying) this.wake();
  }

  /** A picture that stands is drawn as well as can be. */
  #standsSoon(): void {
    clearTimeout(this.#stands);
    this.#stands = setTimeout(() => {
      this.#stands = undefined;
      this.tempo.rest();
      if (this.#isFinal || this.playback.isPlaying) return;
      this.#isFinalDue = true;
      this.wake();
    }, STANDS_MS);
  }

  #draw(isFinal: boolean): void {
    if (this.#renderer === undefined || this.#decoded === undefined) return;
    this.#isFinal = isFinal;
    this.#drawnView = this.shown.view;
    drawShown(this.#renderer, this.#canvas, this.header, this.#decoded.frames, this.shown, isFinal ? 1 : this.tempo.detail, isFinal);
  }

  /** Whether what is to be shown is decoded; begins to decode it where it is not. */
  #fetch(): boolean {
    if (this.#recording === undefined || this.#store === undefined) return false;
    const { frame } = this.shown;
    const wanted = this.#wanted();
    const asked = wanted.map(({ row, col }) => `${row},${col}`).join(" ");
    if (this.#decoded?.frame === frame && this.#decoded.asked === asked) return true;
    if (!this.#isFetching) void this.#decode(frame, wanted, asked);
    return false;
  }

  /** The cameras of all views that are drawn at once. */
  #wanted(): Camera[] {
    const { header } = this;
    const found = new Map<string, Camera>();
    const { view, eyes, focus } = this.shown;
    const lens = focus === undefined ? [view] : apertureOf(header, view).map((one) => one.view);
    for (const one of eyes.mode === "one" ? lens : eyesOf(header, view, eyes.distance)) {
      for (const { camera } of contributors(header, one)) found.set(`${camera.row},${camera.col}`, camera);
    }
    return [...found.values()];
  }

  async #decode(frame: number, wanted: readonly Camera[], asked: string): Promise<void> {
    this.#isFetching = true;
    const timer = setTimeout(() => this.#events.onWaiting(true), WAITING_MS);
    const since = performance.now();
    try {
      const store = this.#store!;
      const isWanted = () => this.playback.isPlaying || this.shown.frame === frame;
      const frames = await store.get(frame, wanted, isWanted);
      this.decodeMs = performance.now() - since;
      if (frames.length > 0 && store === this.#store) this.#decoded = { frame, frames, asked };
      else if (frames.length === 0 && isWanted()) this.#skip(frame, asked);
      if (this.playback.isPlaying) this.#prefetch(frame, wanted);
    } catch (error) {
      this.playback.pause();
      this.#events.onTrouble((error as Error).message, true);
      this.#waiters.splice(0).forEach(({ resolve }) => resolve());
      return;
    } finally {
      clearTimeout(timer);
      this.#isFetching = false;
      this.#events.onWaiting(false);
    }
    this.wake();
  }

  /** No camera has this frame: the last picture stays, as if it were this one. */
  #skip(frame: number, asked: string): void {
    if (this.#decoded === undefined && frame + 1 < this.count) this.shown.frame = frame + 1;
    else this.#decoded = { frame, frames: this.#decoded?.frames ?? [], asked };
  }

  #prefetch(frame: number, wanted: readonly Camera[]): void {
    const isWanted = () => this.playback.isPlaying;
    for (let next = frame + 1; next <= Math.min(frame + PREFETCH, this.count - 1); next++) {
      void this.#store!.get(next, wanted, isWanted).catch(() => {}); // it is asked for again when it is due
    }
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
    if (this.#recording === undefined) return;
    this.#renderer = new ViewRenderer(this.#canvas, this.header);
    this.wake();
  }
}
