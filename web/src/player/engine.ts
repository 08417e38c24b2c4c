/** What is shown: a recording, a frame and a viewpoint, drawn when they change and not otherwise. */

import type { Header } from "../container/header.ts";
import { LiveRecording } from "../container/live.ts";
import { openRecording } from "../container/open.ts";
import { frameAt, frameCount, timeOf, type Recording } from "../container/recording.ts";
import type { Source } from "../container/sources.ts";
import { camerasOf, clampView, type Viewpoint } from "../geometry.ts";
import type { CameraFrame } from "../synthesis/camera_textures.ts";
import { finished } from "../synthesis/gl.ts";
import { ViewRenderer, type Pixels } from "../synthesis/renderer.ts";
import { drawShown, viewsShown } from "./drawing.ts";
import { Immersive, type Due } from "./immersive.ts";
import { measure, Originals } from "./originals.ts";
import { Playback } from "./playback.ts";
import { placed, type EngineEvents, type Opening, type Shown } from "./shown.ts";
import { PART, Standing } from "./standing.ts";
import { Supply } from "./supply.ts";
import { Tempo } from "./tempo.ts";
import { Waiters } from "./waiters.ts";

export class Engine {
  readonly shown: Shown = { frame: 0, view: { row: 0, col: 0 }, look: "picture", dolly: 0, eyes: { mode: "one", distance: 0.5 }, wipe: 0, focus: undefined };
  readonly playback = new Playback();
  readonly tempo = new Tempo();
  readonly #canvas: HTMLCanvasElement;
  readonly #events: EngineEvents;
  #source: Source | undefined;
  #recording: Recording | undefined;
  #supply: Supply | undefined;
  #renderer: ViewRenderer | undefined;
  #immersive: Immersive | undefined;
  /** What views can be compared with. */
  originals: Originals | undefined;
  /** Luma PSNR of the picture that stands against its original, dB; undefined where they are not compared. */
  psnr: number | undefined;
  /** The newest frame of a live view. */
  #liveFrame: number | undefined;
  #isDirty = false;
  /** What is on the screen has all detail; what is drawn next is to have it. */
  #isFinal = false;
  #isFinalDue = false;
  #isGuessed = false;
  #drawnView: Viewpoint | undefined;
  #tick: number | undefined;
  readonly #standing = new Standing(() => this.#stands());
  readonly #waiters = new Waiters();
  isClosed = false;

  constructor(canvas: HTMLCanvasElement, events: EngineEvents) {
    this.#canvas = canvas;
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
      onWaiting: (isWaiting) => this.#events.onWaiting(isWaiting),
      onTrouble: (text, isFatal) => this.#trouble(text, isFatal),
    });
    const { header } = recording;
    this.#renderer = new ViewRenderer(this.#canvas, header);
    const onCame = (trouble?: string) => (trouble === undefined ? undefined : tell(trouble), this.wake());
    if (at.originals !== undefined) this.originals = new Originals(at.originals, header, onCame);
    this.shown.frame = frameAt(recording.spans, at.seconds ?? 0);
    this.shown.view = clampView(header, at.view ?? { row: (header.rows - 1) / 2, col: (header.cols - 1) / 2 });
    this.playback.setEnd(timeOf(recording.spans, this.count - 1) + 1 / header.fps);
    await this.#settled();
  }

  close(): void {
    this.isClosed = true;
    this.playback.pause();
    if (this.#tick !== undefined) cancelAnimationFrame(this.#tick);
    this.#standing.close();
    this.#immersive?.end();
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

  get traffic(): { requests: number; bytes: number } {
    return this.#source?.traffic ?? { requests: 0, bytes: 0 };
  }

  /** The viewpoint that is shown. */
  get view(): Viewpoint {
    return placed(this.shown).view;
  }

  /** The frame that is on the screen. */
  get frame(): number {
    return this.#supply?.decoded?.frame ?? 0;
  }

  /** How long the last frame took to decode. */
  get decodeMs(): number {
    return this.#supply?.decodeMs ?? 0;
  }

  /** What each eye of a headset sees; undefined where the screen shows the picture. */
  get immersed(): readonly Viewpoint[] | undefined {
    return this.#immersive?.views;
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
    const isDone = () => this.#isFinal && !this.#isDirty && this.#supply?.decoded?.frame === this.shown.frame;
    const standing = this.#waiters.until(isDone);
    this.#standing.moved();
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

  /** The view that is shown, at picture size, whatever the screen shows of it: as it stands or, not `fine`, as it moves. Throws Error before the first picture. */
  pixels(fine = true): Pixels {
    const frames = this.#supply?.decoded?.frames;
    if (this.#renderer === undefined || frames === undefined) throw new Error("no picture yet");
    const { look, dolly } = placed(this.shown);
    const pixels = this.#renderer.read(frames, this.view, { look, fine, dolly });
    if (this.#immersive === undefined) this.#draw(true); // the canvas may have lost what it showed
    return pixels;
  }

  /** What is seen at a place of the picture, from its upper left in shares of its size. */
  probe(x: number, y: number): { disparity: number; isSeen: boolean } | undefined {
    const frames = this.#supply?.decoded?.frames;
    if (this.#renderer === undefined || frames === undefined || this.shown.eyes.mode !== "one") return undefined;
    const { width, height } = this.header;
    const { look, dolly } = placed(this.shown);
    const [column, row] = [Math.floor(x * width), Math.floor(y * height)];
    if (column < 0 || row < 0 || column >= width || row >= height) return undefined;
    return this.#renderer.probe(frames, this.view, { look, dolly, fine: false }, column, row);
  }

  /** A small picture of a time, from the nearest camera and keyframe; undefined where it is damaged. */
  async peek(seconds: number, width: number): Promise<ImageData | undefined> {
    return this.#supply?.peek(this.shown.view, seconds, width);
  }

  /** The picture is held, as by a pointer that drags it: it does not come to stand. */
  hold(isHeld: boolean): void {
    this.#standing.hold(isHeld);
  }

  /** Show it in a headset until the viewer, or `leave`, ends that. Throws Error where that is refused, or before a file is open. */
  async immerse(): Promise<void> {
    if (this.#renderer === undefined) throw new Error("no file is open");
    const due = (now: number, views: readonly Viewpoint[]) => this.#due(now, views);
    const started = await Immersive.start(this.#renderer, this.header, this.shown.view, due, () => this.#left());
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
    const isDone = () => view !== this.shown.view || (this.#supply?.decoded?.frame === this.shown.frame && !this.#isDirty);
    await this.#waiters.until(isDone);
  }

  #run(now: number): void {
    this.#tick = undefined;
    if (this.#immersive !== undefined) return;
    this.#playOn(now);
    // While the next frame is decoded, the one that is there can be seen from elsewhere.
    const isReady = (this.isOpen && this.#fetch(viewsShown(this.header, placed(this.shown)))) || this.#drawnView !== this.shown.view;
    const hasOriginal = this.originals?.prepare(this.#renderer, this.#supply?.decoded?.sequence, this.shown) ?? true;
    if (isReady && hasOriginal && this.#isDirty && this.#supply?.decoded !== undefined) {
      this.#isDirty = false;
      const isMoved = this.#drawnView !== this.shown.view;
      this.#draw(this.#isFinalDue || this.tempo.allowsFine(this.#standing.costMs));
      this.psnr = this.#isFinalDue ? measure(this.#renderer, this.#supply.decoded.frames, this.view) : undefined;
      if (this.#isFinalDue) void this.#standing.time(finished(this.#renderer!.gl));
      else this.tempo.drawn(now, isMoved ? 0 : this.#framePeriodMs);
      if (!this.#isGuessed && this.tempo.allowsFine(this.#standing.costMs ?? 0)) void this.#guess(this.#renderer!, this.#supply.decoded.frames);
      this.#isFinalDue = false;
      this.#events.onFrame();
      this.#standing.moved();
    }
    this.#waiters.look();
    if (this.playback.isPlaying) this.#schedule();
  }

  /** Whether pictures in all detail are worth a try while it moves, as it may do from the start. */
  async #guess(renderer: ViewRenderer, frames: readonly CameraFrame[]): Promise<void> {
    this.#isGuessed = true;
    const draw = () => (renderer.drawMiddle(frames, this.view, PART), finished(renderer.gl));
    if (this.#standing.costMs !== undefined || !(await this.#standing.guess(draw)) || this.isClosed) return;
    this.#isFinalDue = true;
    this.wake();
  }

  /** From one frame to the next while it plays, ms; else 0. */
  get #framePeriodMs(): number {
    return this.playback.isPlaying ? 1000 / (this.header.fps * this.playback.speed) : 0;
  }

  /** What is to be drawn for a headset, whose own clock comes in place of the screen's. */
  #due(now: number, views: readonly Viewpoint[]): Due {
    this.#playOn(now);
    if (this.#fetch(views)) this.#isDirty = false;
    this.tempo.drawn(now, 0);
    this.#waiters.look();
    return { frames: this.#supply?.decoded?.frames, shown: this.shown, detail: this.tempo.detail };
  }

  /** The headset is off: the screen shows the picture again. */
  #left(): void {
    this.#immersive = undefined;
    this.tempo.rest();
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

  /** A picture that stands is drawn as well as can be. */
  #stands(): void {
    this.tempo.rest();
    if (this.playback.isPlaying) return;
    if (this.#isFinal) return this.#measure();
    this.#isFinalDue = true;
    this.wake();
  }

  #measure(): void {
    if (this.psnr !== undefined) return;
    this.psnr = measure(this.#renderer, this.#supply?.decoded?.frames, this.view);
    if (this.psnr === undefined) return;
    this.#draw(true); // the canvas may have lost what it showed
    this.#events.onState();
  }

  #draw(isFinal: boolean): void {
    const frames = this.#supply?.decoded?.frames;
    if (this.#renderer === undefined || frames === undefined) return;
    this.#isFinal = isFinal;
    this.#drawnView = this.shown.view;
    drawShown(this.#renderer, this.#canvas, this.header, frames, placed(this.shown), isFinal ? 1 : this.tempo.detail, isFinal);
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
    if (this.#recording === undefined) return;
    this.#renderer = new ViewRenderer(this.#canvas, this.header);
    this.wake();
  }
}
