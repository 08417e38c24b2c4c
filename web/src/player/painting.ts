/** What the canvas shows of decoded frames: drafts while something moves, all detail when it stands. */

import type { Header } from "../container/header.ts";
import { depthOf, type Viewpoint } from "../geometry.ts";
import type { CameraFrame } from "../synthesis/camera_textures.ts";
import { finished, forgetPrograms } from "../synthesis/gl.ts";
import { ViewRenderer, type Pixels } from "../synthesis/renderer.ts";
import { DraftCanvas } from "./draft_canvas.ts";
import { drawShown, isPlain, sizeOf } from "./drawing.ts";
import type { Place } from "./engine.ts";
import { measure, type Originals } from "./originals.ts";
import { placed, type Shown } from "./shown.ts";
import { PART, Standing } from "./standing.ts";
import type { Decoded } from "./supply.ts";
import { Tempo } from "./tempo.ts";

/** Who knows what is to be painted. */
export interface Subject {
  readonly decoded: Decoded | undefined;
  readonly shown: Shown;
  /** From one frame to the next while it plays, ms; else 0. */
  readonly framePeriodMs: number;
  readonly isClosed: boolean;
  /** Paint again, with the next picture of the screen. */
  wake(): void;
  /** The picture has been measured. */
  onMeasured(): void;
}

export class Painting {
  readonly tempo = new Tempo();
  /** Luma PSNR of the picture that stands against its original, dB; undefined where they are not compared. */
  psnr: number | undefined;
  /** The canvas is recorded: drafts go there too. */
  isRecorded = false;
  readonly #canvas: HTMLCanvasElement;
  readonly #header: Header;
  readonly #originals: Originals | undefined;
  readonly #subject: Subject;
  readonly #standing = new Standing(() => this.#stands());
  readonly #draft = new DraftCanvas();
  #renderer: ViewRenderer;
  /** What is on the screen has all detail; what is drawn next is to have it. */
  #isFinal = false;
  #isFinalDue = false;
  #isGuessed = false;
  #drawnView: Viewpoint | undefined;

  /** Throws Error where there is no WebGL 2. */
  constructor(canvas: HTMLCanvasElement, header: Header, originals: Originals | undefined, subject: Subject) {
    this.#canvas = canvas;
    this.#header = header;
    this.#originals = originals;
    this.#subject = subject;
    this.#renderer = new ViewRenderer(canvas, header);
    canvas.after(this.#draft.canvas);
  }

  get renderer(): ViewRenderer {
    return this.#renderer;
  }

  get isFinal(): boolean {
    return this.#isFinal;
  }

  /** The view that is asked for is not the one on the screen. */
  get isMoved(): boolean {
    return this.#drawnView !== this.#subject.shown.view;
  }

  /** Whether what the view is compared with is at hand, where it is; begins to fetch it otherwise. */
  prepare(): boolean {
    return this.#originals?.prepare(this.#renderer, this.#subject.decoded?.sequence, this.#subject.shown) ?? true;
  }

  /** A picture of the screen is due; there are decoded frames. */
  paint(now: number): void {
    const { frames } = this.#subject.decoded!;
    const { isMoved } = this;
    const isFinal = this.#isFinalDue;
    this.#isFinalDue = false;
    this.#draw(isFinal || this.tempo.allowsFine(this.#standing.costMs));
    this.psnr = isFinal ? measure(this.#renderer, frames, this.#view) : undefined;
    if (isFinal) void this.#standing.time(finished(this.#renderer.gl));
    else this.tempo.drawn(now, isMoved ? 0 : this.#subject.framePeriodMs);
    if (!this.#isGuessed && this.tempo.allowsFine(this.#standing.costMs ?? 0)) void this.#guess(frames);
  }

  /** Something has changed: it stands only a while after. */
  moved(): void {
    this.#standing.moved();
  }

  hold(isHeld: boolean): void {
    this.#standing.hold(isHeld);
  }

  pixels(fine: boolean, isOnScreen: boolean): Pixels {
    const { look, dolly } = placed(this.#subject.shown);
    const pixels = this.#renderer.read(this.#frames!, this.#view, { look, fine, dolly });
    if (isOnScreen) this.#draw(true); // the canvas may have lost what it showed
    return pixels;
  }

  probe(x: number, y: number): Place | undefined {
    const { width, height } = this.#header;
    const { look, dolly, eyes } = placed(this.#subject.shown);
    const [column, row] = [Math.floor(x * width), Math.floor(y * height)];
    if (this.#frames === undefined || eyes.mode !== "one" || column < 0 || row < 0 || column >= width || row >= height) return undefined;
    const { disparity } = this.#renderer.probe(this.#frames, this.#view, { look, dolly, fine: false }, column, row);
    return { disparity, metres: depthOf(this.#header, disparity) };
  }

  /** The GPU has forgotten everything. */
  restore(): void {
    forgetPrograms(this.#renderer.gl);
    this.#renderer = new ViewRenderer(this.#canvas, this.#header);
  }

  close(): void {
    this.#standing.close();
    this.#renderer.delete();
    this.#draft.canvas.remove();
  }

  get #frames(): readonly CameraFrame[] | undefined {
    return this.#subject.decoded?.frames;
  }

  get #view(): Viewpoint {
    return placed(this.#subject.shown).view;
  }

  #draw(isFinal: boolean): void {
    if (this.#frames === undefined) return;
    this.#isFinal = isFinal;
    this.#drawnView = this.#subject.shown.view;
    const detail = isFinal ? 1 : this.tempo.detail;
    const shown = placed(this.#subject.shown);
    if (!isFinal && isPlain(shown) && !this.isRecorded) {
      const [width, height] = sizeOf(this.#header, detail);
      this.#draft.show(this.#renderer.draft(this.#frames, shown.view, shown, width, height), width, height);
      return;
    }
    this.#draft.hide();
    drawShown(this.#renderer, this.#canvas, this.#header, this.#frames, shown, detail, isFinal);
  }

  /** Whether pictures in all detail are worth a try while it moves, as it may do from the start. */
  async #guess(frames: readonly CameraFrame[]): Promise<void> {
    this.#isGuessed = true;
    const renderer = this.#renderer;
    const draw = () => (renderer.drawMiddle(frames, this.#view, PART), finished(renderer.gl));
    if (this.#standing.costMs !== undefined || !(await this.#standing.guess(draw)) || this.#subject.isClosed) return;
    this.#isFinalDue = true;
    this.#subject.wake();
  }

  /** A picture that stands is drawn as well as can be. */
  #stands(): void {
    this.tempo.rest();
    if (this.#subject.framePeriodMs > 0) return;
    if (this.#isFinal) return this.#measure();
    this.#isFinalDue = true;
    this.#subject.wake();
  }

  #measure(): void {
    if (this.psnr !== undefined) return;
    this.psnr = measure(this.#renderer, this.#frames, this.#view);
    if (this.psnr === undefined) return;
    this.#draw(true); // the canvas may have lost what it showed
    this.#subject.onMeasured();
  }
}
