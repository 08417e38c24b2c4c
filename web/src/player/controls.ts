/** The bar of controls: what it is made of, and how it follows the player. */

import { LOOKS, type Look } from "../synthesis/renderer.ts";
import { button, element, icon, options } from "./dom.ts";
import { EYE_MODES, type Eyes } from "./drawing.ts";
import { timeText } from "./format.ts";
import { SPEEDS } from "./playback.ts";
import { TEXTS } from "./texts.ts";
import { Tilt } from "./tilt.ts";

/** What the controls ask for. */
export interface Actions {
  togglePlay(): void;
  step(by: number): void;
  seekTo(seconds: number): void;
  setSpeed(speed: number): void;
  setLook(look: Look): void;
  setEyes(mode: Eyes["mode"]): void;
  setWipe(share: number): void;
  setFocus(disparity: number | undefined): void;
  savePicture(): void;
  saveClip(): void;
  copyLink(): void;
  openFile(): void;
  toggleFullscreen(): void;
  /** Ask for the phone's turns; whether that is allowed. */
  followTilt(): Promise<boolean>;
  toggleHeadset(): void;
  showHelp(): void;
  /** A small picture of a time; undefined where there is none. */
  peek(seconds: number): Promise<ImageData | undefined>;
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
  readonly isImmersed: boolean;
  readonly section: { from: number; to: number } | undefined;
  readonly isGrowing: boolean;
}

/** Steps of the bar; a second has more than any speed of playing needs. */
const STEPS_PER_SECOND = 1000;
const FOCUS_OFF = 0;

export class Controls {
  readonly bar: HTMLElement;
  readonly menu: HTMLElement;
  readonly #actions: Actions;
  readonly #play: HTMLButtonElement;
  readonly #time = element("span", { class: "time" });
  readonly #timeline = element("input", { type: "range", min: "0", max: "0", step: "1", "aria-label": TEXTS.timeline });
  readonly #section = element("div", { class: "section", hidden: true });
  readonly #peek = element("div", { class: "peek", hidden: true });
  readonly #speed = element("select", { "aria-label": TEXTS.speed, title: TEXTS.speed });
  readonly #look = element("select", { "aria-label": TEXTS.show, title: TEXTS.show });
  readonly #eyes = element("select", { "aria-label": TEXTS.views });
  readonly #wipe = element("input", { type: "range", min: "0", max: "1", step: "0.01", value: "0" });
  readonly #focus = element("input", { type: "range", min: "0", max: "100", step: "1", value: "0" });
  readonly #headset: HTMLButtonElement;
  readonly #tilt: HTMLButtonElement;
  /** What does nothing without a file. */
  readonly #forFile: (HTMLButtonElement | HTMLInputElement | HTMLSelectElement)[] = [];
  #range: readonly [number, number] = [0, 1];
  #duration = 0;
  #peeked = 0;

  constructor(actions: Actions) {
    this.#actions = actions;
    this.#play = button(TEXTS.play, icon("play"), () => actions.togglePlay());
    options(this.#speed, SPEEDS.map((speed) => [String(speed), `${speed}×`]));
    options(this.#look, Object.entries(TEXTS.looks));
    options(this.#eyes, Object.entries(TEXTS.eyes));
    this.#headset = button(TEXTS.headset, TEXTS.headset, () => {
      this.toggleMenu(false);
      actions.toggleHeadset();
    });
    this.#headset.hidden = true;
    this.#tilt = button(TEXTS.tilt, TEXTS.tilt, async () => {
      this.toggleMenu(false);
      this.#tilt.hidden = await actions.followTilt();
    });
    this.#tilt.hidden = !Tilt.asksFirst;
    this.menu = this.#makeMenu();
    this.bar = this.#makeBar();
    this.#listen();
  }

  setRange(range: readonly [number, number]): void {
    this.#range = range;
  }

  /** Whether there is a file that they can do something with. */
  enable(isOpen: boolean): void {
    for (const control of this.#forFile) control.disabled = !isOpen;
  }

  /** Whether there is something to compare with. */
  offerOriginals(areThere: boolean): void {
    for (const option of this.#look.options) if (option.value === "difference") option.hidden = option.disabled = !areThere;
  }

  offerHeadset(isThere: boolean): void {
    this.#headset.hidden = !isThere;
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
    const actions = this.#actions;
    this.#play.classList.add("fills");
    const [back, on] = [button(TEXTS.back, icon("back"), () => actions.step(-1)), button(TEXTS.on, icon("on"), () => actions.step(1))];
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
        button(TEXTS.fullscreen, icon("fullscreen"), () => actions.toggleFullscreen()),
      ),
    );
  }

  #makeMenu(): HTMLElement {
    const actions = this.#actions;
    const act = (text: string, call: () => void) => button(text, text, () => {
      this.toggleMenu(false);
      call();
    });
    return element("div", { class: "menu", hidden: true },
      element("label", {}, TEXTS.views, this.#eyes),
      element("label", {}, TEXTS.wipe, this.#wipe),
      element("label", {}, TEXTS.focus, this.#focus),
      this.#headset,
      this.#tilt,
      act(TEXTS.savePicture, () => actions.savePicture()),
      act(TEXTS.saveClip, () => actions.saveClip()),
      act(TEXTS.copyLink, () => actions.copyLink()),
      act(TEXTS.openFile, () => actions.openFile()),
      act(TEXTS.help, () => actions.showHelp()),
    );
  }

  #listen(): void {
    const actions = this.#actions;
    this.#timeline.addEventListener("input", () => actions.seekTo(Number(this.#timeline.value) / STEPS_PER_SECOND));
    this.#speed.addEventListener("change", () => actions.setSpeed(Number(this.#speed.value)));
    this.#look.addEventListener("change", () => actions.setLook(LOOKS.find((look) => look === this.#look.value)!));
    this.#eyes.addEventListener("change", () => actions.setEyes(EYE_MODES.find((mode) => mode === this.#eyes.value)!));
    this.#wipe.addEventListener("input", () => actions.setWipe(Number(this.#wipe.value)));
    this.#focus.addEventListener("input", () => {
      const share = Number(this.#focus.value);
      const [low, high] = this.#range;
      actions.setFocus(share === FOCUS_OFF ? undefined : low + ((share - 1) / 99) * (high - low));
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
    const picture = await this.#actions.peek(seconds);
    if (picture === undefined || number !== this.#peeked) return;
    const canvas = element("canvas");
    [canvas.width, canvas.height] = [picture.width, picture.height];
    canvas.getContext("2d")?.putImageData(picture, 0, 0);
    this.#peek.replaceChildren(canvas, timeText(seconds));
  }
}
