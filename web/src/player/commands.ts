/** What viewers can ask for, by keys, buttons and gestures alike, and what it does to the engine. */

import { mostDolly } from "../geometry.ts";
import { EYE_MODES, type Eyes } from "./drawing.ts";
import type { Engine } from "./engine.ts";
import { Looking } from "./looking.ts";
import { SPEEDS } from "./playback.ts";
import { Marks, type Mark } from "./section.ts";
import type { Shown } from "./shown.ts";
import { linkTo, saveLoop, savePicture } from "./take_away.ts";
import { TEXTS } from "./texts.ts";

/** How far apart eyes go by a key, in steps of the array. */
const EYES_STEP = 0.05;

export interface Answers {
  /** Something has changed that is shown beside the picture. */
  update(): void;
  /** For people who hear rather than see. */
  say(text: string): void;
  /** For everybody; undefined: nothing any more. */
  tell(text: string | undefined): void;
}

export class Commands {
  readonly looking = new Looking();
  readonly #answers: Answers;
  #engine: Engine | undefined;
  #marks = new Marks();

  constructor(answers: Answers) {
    this.#answers = answers;
  }

  attach(engine: Engine): void {
    this.#engine = engine;
    this.#marks = new Marks();
  }

  togglePlay(): void {
    if (this.#engine?.playback.isPlaying) this.#engine.pause();
    else this.#engine?.play();
  }

  step(by: number): void {
    this.#engine?.pause();
    void this.#engine?.seek(this.#engine.shown.frame + by);
  }

  seekTo(seconds: number): void {
    void this.#engine?.seek(this.#engine.frameAt(seconds));
  }

  /** By some seconds, or a tenth of a short file. */
  skip(direction: number): void {
    const engine = this.#engine;
    if (engine === undefined) return;
    const duration = engine.timeOf(engine.count - 1);
    this.seekTo(engine.timeOf(engine.shown.frame) + direction * Math.min(5, Math.max(duration / 10, 0.1)));
  }

  dolly(by: number): void {
    const engine = this.#open;
    if (engine === undefined) return;
    const most = mostDolly(engine.header);
    void engine.change({ dolly: Math.min(Math.max(engine.shown.dolly + by * most, 0), most) });
  }

  setSpeed(speed: number): void {
    this.#engine?.setSpeed(speed);
  }

  changeSpeed(by: number): void {
    const place = SPEEDS.findIndex((speed) => speed >= (this.#engine?.playback.speed ?? 1));
    this.setSpeed(SPEEDS[Math.min(Math.max(place + by, 0), SPEEDS.length - 1)]);
  }

  /** The loop begins, or ends, at the frame that is shown. */
  markSection(mark: Mark): void {
    const engine = this.#open;
    engine?.setSection(this.#marks.mark(mark, engine.timeOf(engine.shown.frame), engine.timeOf(engine.count - 1)));
  }

  change(what: Partial<Omit<Shown, "frame" | "view">>): void {
    const engine = this.#open;
    if (engine === undefined) return;
    void engine.change(what);
    this.#answers.update();
  }

  nextLook(): void {
    const engine = this.#open;
    if (engine === undefined) return;
    const { looks } = engine;
    const look = looks[(looks.indexOf(engine.shown.look) + 1) % looks.length];
    this.change({ look });
    this.#answers.say(TEXTS.looks[look]);
  }

  setEyes(eyes: Partial<Eyes>): void {
    const engine = this.#open;
    if (engine === undefined) return;
    const { mode, distance } = { ...engine.shown.eyes, ...eyes };
    this.change({ eyes: { mode, distance: Math.min(Math.max(Math.round(distance / EYES_STEP) * EYES_STEP, 0), engine.header.cols - 1) } });
  }

  nextEyes(): void {
    const engine = this.#open;
    if (engine === undefined) return;
    const mode = EYE_MODES[(EYE_MODES.indexOf(engine.shown.eyes.mode) + 1) % EYE_MODES.length];
    this.setEyes({ mode });
    this.#answers.say(TEXTS.eyes[mode]);
  }

  changeEyes(by: number): void {
    if (this.#open !== undefined) this.setEyes({ distance: this.#open.shown.eyes.distance + by * EYES_STEP });
  }

  /** Follow the pointer, or not. */
  toggleHover(): void {
    this.looking.hovers = !this.looking.hovers;
    this.#answers.say(this.looking.hovers ? TEXTS.follows : TEXTS.followsNot);
  }

  savePicture(): void {
    const engine = this.#open;
    if (engine !== undefined) void savePicture(engine.pixels(), `${engine.header.name || "view"}-${engine.frame}`);
  }

  async saveClip(): Promise<void> {
    const engine = this.#open;
    if (engine === undefined) return;
    this.#answers.tell(TEXTS.recording);
    await saveLoop(engine)
      .then(() => this.#answers.tell(undefined), (error: Error) => this.#answers.tell(error.message));
  }

  async copyLink(): Promise<void> {
    const engine = this.#open;
    if (engine === undefined) return;
    const link = linkTo(engine.shown.view, engine.timeOf(engine.frame));
    // Browsers give pages a clipboard where they trust them.
    await Promise.resolve(navigator.clipboard?.writeText(link) ?? Promise.reject(new Error("no clipboard")))
      .then(() => this.#answers.tell(TEXTS.linkCopied), () => this.#answers.tell(link));
  }

  /** Into the headset, or out of it. */
  async toggleHeadset(): Promise<void> {
    const engine = this.#open;
    if (engine === undefined) return;
    if (engine.immersed !== undefined) engine.leave();
    else await engine.immerse().catch((error: Error) => this.#answers.tell(TEXTS.noHeadset(error.message)));
  }

  /** A small picture of a time; undefined where there is none. */
  async peek(seconds: number): Promise<ImageData | undefined> {
    return this.#engine?.peek(seconds);
  }

  get #open(): Engine | undefined {
    return this.#engine?.isOpen ? this.#engine : undefined;
  }
}
