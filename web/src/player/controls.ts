/** The bar of controls: what it is made of, and how it follows the player. */

import { LOOKS, type Look } from "../synthesis/looks.ts";
import type { Commands } from "./commands.ts";
import { button, element, icon, options } from "./dom.ts";
import { EYE_MODES, type Eyes } from "./drawing.ts";
import type { Engine } from "./engine.ts";
import { timeText } from "./format.ts";
import { SPEEDS } from "./playback.ts";
import type { Section } from "./section.ts";
import { TEXTS } from "./texts.ts";
import { Tilt } from "./tilt.ts";

/** What the controls ask of the page around the picture. */
export interface Surroundings {
  tell(text: string): void;
  openFile(): void;
  toggleFullscreen(): void;
  showHelp(): void;
}

/** What the controls show. */
export interface ControlState {
  readonly isPlaying: boolean;
  readonly seconds: number;
  /** Of the last frame; it is shown until `end`. */
  readonly duration: number;
  readonly end: number;
  readonly speed: number;
  readonly look: Look;
  readonly eyes: Eyes["mode"];
  /** Of the eyes, in steps of the array. */
  readonly distance: number;
  readonly isImmersed: boolean;
  readonly section: Section | undefined;
  readonly isGrowing: boolean;
}

/** Steps of the bar; a second has more than any speed of playing needs. */
const STEPS_PER_SECOND = 1000;
const FOCUS_OFF = 0;

export class Controls {
  readonly bar: HTMLElement;
  readonly menu: HTMLElement;
  readonly #commands: Commands;
  readonly #around: Surroundings;
  readonly #play: HTMLButtonElement;
  readonly #time = element("span", { class: "time" });
  readonly #timeline = element("input", { type: "range", min: "0", max: "0", step: "1", "aria-label": TEXTS.timeline });
  readonly #section = element("div", { class: "section", hidden: true });
  readonly #peek = element("div", { class: "peek", hidden: true });
  readonly #speed = element("select", { "aria-label": TEXTS.speed, title: TEXTS.speed });
  readonly #look = element("select", { "aria-label": TEXTS.show, title: TEXTS.show });
  readonly #eyes = element("select", { "aria-label": TEXTS.views });
  readonly #distance = element("input", { type: "range", min: "0", max: "1", step: "0.05", value: "0.5" });
  readonly #distanceBox = element("label", { hidden: true }, TEXTS.distance, this.#distance);
  readonly #wipe = element("input", { type: "range", min: "0", max: "1", step: "0.01", value: "0" });
  readonly #focus = element("input", { type: "range", min: "0", max: "100", step: "1", value: "0" });
  readonly #headset: HTMLButtonElement;
  readonly #tilt: HTMLButtonElement;
  /** What does nothing without a file. */
  readonly #forFile: (HTMLButtonElement | HTMLInputElement | HTMLSelectElement)[] = [];
  #isHeadsetThere = false;
  #canImmerse = false;
  #range: readonly [number, number] = [0, 1];
  #duration = 0;
  #peeked = 0;

  constructor(commands: Commands, around: Surroundings) {
    this.#commands = commands;
    this.#around = around;
    this.#play = button(TEXTS.play, icon("play"), () => commands.togglePlay());
    options(this.#speed, SPEEDS.map((speed) => [String(speed), `${speed}×`]));
    options(this.#look, Object.entries(TEXTS.looks));
    options(this.#eyes, Object.entries(TEXTS.eyes));
    this.#headset = button(TEXTS.headset, TEXTS.headset, () => {
      this.toggleMenu(false);
      void commands.toggleHeadset();
    });
    this.#headset.hidden = true;
    this.#tilt = button(TEXTS.tilt, TEXTS.tilt, async () => {
      this.toggleMenu(false);
      this.#tilt.hidden = await Tilt.ask();
      if (!this.#tilt.hidden) around.tell(TEXTS.tiltRefused);
    });
    this.#tilt.hidden = !Tilt.asksFirst;
    this.menu = this.#makeMenu();
    this.bar = this.#makeBar();
    this.#listen();
  }

  /** What an engine has to offer. */
  offer({ header, looks, canImmerse }: Engine): void {
    this.#range = header.range;
    this.#wipe.value = this.#focus.value = "0";
    this.#distance.max = String(header.cols - 1);
    this.#canImmerse = canImmerse;
    for (const option of this.#look.options) option.hidden = option.disabled = !looks.some((look) => look === option.value);
    this.#showHeadset();
  }

  /** Whether there is a file that they can do something with. */
  enable(isOpen: boolean): void {
    for (const control of this.#forFile) control.disabled = !isOpen;
  }

  offerHeadset(isThere: boolean): void {
    this.#isHeadsetThere = isThere;
    this.#showHeadset();
  }

  toggleMenu(isOpen = this.menu.hidden): void {
    this.menu.hidden = !isOpen;
  }

  update(state: ControlState): void {
    const label = state.isPlaying ? TEXTS.pause : TEXTS.play;
    if (this.#play.title !== label) {
      this.#play.title = label;
      this.#play.setAttribute("aria-label", label);
      this.#play.replaceChildren(icon(state.isPlaying ? "pause" : "play"));
    }
    this.#duration = state.duration;
    const text = `${timeText(state.seconds)} / ${timeText(state.end)}`;
    this.#time.textContent = state.isGrowing ? `${text} ${TEXTS.live}` : text;
    this.#timeline.max = String(Math.round(state.duration * STEPS_PER_SECOND));
    this.#timeline.value = String(Math.round(state.seconds * STEPS_PER_SECOND));
    this.#timeline.setAttribute("aria-valuetext", text);
    this.#speed.value = String(state.speed);
    this.#look.value = state.look;
    this.#eyes.value = state.eyes;
    this.#distanceBox.hidden = state.eyes === "one";
    this.#distance.value = String(state.distance);
    const headset = state.isImmersed ? TEXTS.headsetOff : TEXTS.headset;
    if (this.#headset.title !== headset) {
      this.#headset.title = headset;
      this.#headset.setAttribute("aria-label", headset);
      this.#headset.textContent = headset;
    }
    this.#wipe.disabled = state.look === LOOKS[0];
    this.#section.hidden = state.section === undefined;
    if (state.section !== undefined && state.duration > 0) {
      this.#section.style.left = `${(100 * state.section.from) / state.duration}%`;
      this.#section.style.width = `${(100 * (state.section.to - state.section.from)) / state.duration}%`;
    }
  }

  #makeBar(): HTMLElement {
    const commands = this.#commands;
    this.#play.classList.add("fills");
    const [back, on] = [button(TEXTS.back, icon("back"), () => commands.step(-1)), button(TEXTS.on, icon("on"), () => commands.step(1))];
    this.#forFile.push(back, this.#play, on, this.#timeline, this.#look, this.#speed);
    this.#speed.value = "1";
    return element("div", { class: "controls" },
      element("div", { class: "track" }, this.#section, this.#timeline, this.#peek),
      element("div", { class: "row" },
        back,
        this.#play,
        on,
        this.#time,
        element("span", { class: "gap" }),
        this.#look,
        this.#speed,
        button(TEXTS.more, icon("more"), () => this.toggleMenu()),
        button(TEXTS.fullscreen, icon("fullscreen"), () => this.#around.toggleFullscreen()),
      ),
    );
  }

  #makeMenu(): HTMLElement {
    const commands = this.#commands;
    const around = this.#around;
    const act = (text: string, call: () => void) => button(text, text, () => {
      this.toggleMenu(false);
      call();
    });
    return element("div", { class: "menu", hidden: true },
      element("label", {}, TEXTS.views, this.#eyes),
      this.#distanceBox,
      element("label", {}, TEXTS.wipe, this.#wipe),
      element("label", {}, TEXTS.focus, this.#focus),
      this.#headset,
      this.#tilt,
      act(TEXTS.savePicture, () => commands.savePicture()),
      act(TEXTS.saveClip, () => void commands.saveClip()),
      act(TEXTS.copyLink, () => void commands.copyLink()),
      act(TEXTS.openFile, () => around.openFile()),
      act(TEXTS.help, () => around.showHelp()),
    );
  }

  #showHeadset(): void {
    this.#headset.hidden = !(this.#isHeadsetThere && this.#canImmerse);
  }

  #listen(): void {
    const commands = this.#commands;
    this.#timeline.addEventListener("input", () => commands.seekTo(Number(this.#timeline.value) / STEPS_PER_SECOND));
    this.#speed.addEventListener("change", () => commands.setSpeed(Number(this.#speed.value)));
    this.#look.addEventListener("change", () => commands.change({ look: LOOKS.find((look) => look === this.#look.value)! }));
    this.#eyes.addEventListener("change", () => commands.setEyes({ mode: EYE_MODES.find((mode) => mode === this.#eyes.value)! }));
    this.#distance.addEventListener("input", () => commands.setEyes({ distance: Number(this.#distance.value) }));
    this.#wipe.addEventListener("input", () => commands.change({ wipe: Number(this.#wipe.value) }));
    this.#focus.addEventListener("input", () => {
      const share = Number(this.#focus.value);
      const [low, high] = this.#range;
      commands.change({ focus: share === FOCUS_OFF ? undefined : low + ((share - 1) / 99) * (high - low) });
      this.#focus.setAttribute("aria-valuetext", share === FOCUS_OFF ? TEXTS.everythingSharp : `${share} %`);
    });
    this.#timeline.addEventListener("pointermove", (event) => void this.#showPeek(event));
    this.#timeline.addEventListener("pointerleave", () => {
      this.#peeked++;
      this.#peek.hidden = true;
    });
  }

  async #showPeek(event: PointerEvent): Promise<void> {
    const box = this.#timeline.getBoundingClientRect();
    const share = Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1);
    const seconds = share * this.#duration;
    const number = ++this.#peeked;
    this.#peek.hidden = false;
    this.#peek.style.left = `clamp(86px, ${100 * share}%, calc(100% - 86px))`;
    const [old] = this.#peek.getElementsByTagName("canvas");
    this.#peek.replaceChildren(...(old === undefined ? [] : [old]), timeText(seconds));
    const picture = await this.#commands.peek(seconds);
    if (picture === undefined || number !== this.#peeked) return;
    const canvas = element("canvas");
    [canvas.width, canvas.height] = [picture.width, picture.height];
    canvas.getContext("2d")?.putImageData(picture, 0, 0);
    this.#peek.replaceChildren(canvas, timeText(seconds));
  }
}
