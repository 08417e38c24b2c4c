/** What surrounds the picture: controls, gestures, keys, messages; and how they act on the engine. */

import { mostDolly } from "../geometry.ts";
import { LOOKS } from "../synthesis/renderer.ts";
import { Controls } from "./controls.ts";
import { button, element, icon } from "./dom.ts";
import { EYE_MODES } from "./drawing.ts";
import type { Engine } from "./engine.ts";
import { Gestures } from "./gestures.ts";
import { hasHeadset } from "./immersive.ts";
import { Idle } from "./idle.ts";
import { Incoming } from "./incoming.ts";
import { isForControl, keyActions, keyList } from "./keys.ts";
import { Legend } from "./legend.ts";
import { Looking } from "./looking.ts";
import { Notice } from "./notice.ts";
import { Probe } from "./probe.ts";
import { Section, type Mark } from "./section.ts";
import { statistics } from "./statistics.ts";
import { linkTo, saveLoop, savePicture } from "./take_away.ts";
import { TEXTS } from "./texts.ts";
import { Tilt } from "./tilt.ts";

const HINT_MS = 4000;
const PEEK_PX = 160;
/** While it plays, what stands beside the picture changes no more often: each change costs as much as a picture where there is no GPU. */
const UPDATE_MS = 200;

export class Ui {
  readonly #host: HTMLElement;
  readonly #canvas: HTMLCanvasElement;
  readonly #stage = element("div", { class: "stage", tabindex: "0", role: "application", "aria-label": TEXTS.stage });
  readonly #wait = element("p", { class: "wait", role: "status", hidden: true });
  readonly #big = button(TEXTS.play, icon("play"), () => this.togglePlay());
  readonly #hint = element("p", { class: "hint", hidden: true }, TEXTS.hint);
  readonly #notice = new Notice();
  readonly #stats = element("pre", { class: "stats", hidden: true });
  readonly #probe = new Probe();
  readonly #spoken = element("p", { class: "unseen", role: "status" });
  readonly #dialog = keyList();
  readonly #incoming: Incoming;
  readonly #legend = new Legend();
  readonly #poster = element("img", { class: "poster", alt: "", hidden: true });
  readonly controls: Controls;
  readonly #keys: ReadonlyMap<string, () => void>;
  #gestures: Gestures | undefined;
  #engine: Engine | undefined;
  readonly looking = new Looking();
  #section = new Section();
  #isTouched = false;
  #hasPlayed = false;
  #updatedAt = 0;
  readonly #idle: Idle;
  #stop = new AbortController();

  constructor(host: HTMLElement, root: ShadowRoot, canvas: HTMLCanvasElement, open: (from: Blob) => void) {
    this.#host = host;
    this.#canvas = canvas;
    this.#incoming = new Incoming(open);
    this.controls = new Controls(this.#actions());
    this.#idle = new Idle(this.#stage, this.controls);
    this.#keys = keyActions(this);
    this.#big.classList.add("big", "fills");
    this.#big.hidden = true;
    this.#stage.append(canvas, this.#poster);
    const middle = element("div", { class: "middle" }, this.#wait, this.#big);
    root.append(this.#stage, middle, this.#hint, this.#stats, this.#probe.label, this.controls.bar, this.controls.menu,
      this.#notice.box, this.#legend.box, this.#spoken, this.#dialog, this.#incoming.input);
  }

  connect(): void {
    this.#stop = new AbortController();
    const { signal } = this.#stop;
    this.#gestures = new Gestures(this.#stage, {
      onTouch: () => this.endSway(),
      onHold: (isHeld) => this.#engine?.hold(isHeld),
      onDrag: (across, down) => this.looking.drag(across, down),
      onHover: (at) => this.#hover(at),
      onDolly: (by) => this.dolly(by),
      onClick: () => this.#click(),
      onDoubleClick: () => this.toggleFullscreen(),
    });
    // The page listens everywhere, an element within another page only where it has the focus.
    const keyboard: EventTarget = this.#host.hasAttribute("page") ? document : this.#host;
    keyboard.addEventListener("keydown", (event) => this.#key(event as KeyboardEvent), { signal });
    for (const name of ["pointermove", "focusin"]) this.#host.addEventListener(name, () => this.#idle.end(), { signal });
    this.#incoming.listen(this.#host, signal);
    new Tilt((right, down) => this.looking.turn(right, down)).listen(signal);
    const lookForHeadset = () => void hasHeadset().then((isThere) => this.controls.offerHeadset(isThere));
    navigator.xr?.addEventListener("devicechange", lookForHeadset, { signal });
    lookForHeadset();
    const poster = this.#host.getAttribute("poster");
    this.#poster.hidden = poster === null;
    if (poster !== null) this.#poster.src = poster;
    this.#idle.end();
  }

  disconnect(): void {
    this.#stop.abort();
    this.#gestures?.close();
    this.#idle.close();
  }

  attach(engine: Engine): void {
    this.#engine = engine;
    this.controls.enable(false);
    this.#notice.hide();
    this.#hasPlayed = false;
    this.#section = new Section();
  }

  /** The first picture is there. */
  opened(isViewGiven: boolean): void {
    const engine = this.#engine!;
    this.controls.setRange(engine.header.range);
    this.controls.offerOriginals(engine.originals !== undefined);
    this.controls.enable(true);
    this.#big.hidden = engine.count < 2 || this.#host.hasAttribute("autoplay");
    if (engine.header.predicted.length > 0) this.tell(TEXTS.predicted(engine.header.predicted.length));
    else if (engine.header.mapCameras === "none") this.tell(TEXTS.noMaps);
    else if (engine.header.enhancedViews > 0) this.tell(TEXTS.enhanced(engine.header.enhancedViews));
    const isStill = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const sways = !this.#isTouched && !isViewGiven && !isStill;
    this.looking.attach(engine, sways);
    if (sways) {
      this.#hint.hidden = false;
      setTimeout(() => (this.#hint.hidden = true), HINT_MS);
    }
    this.#idle.end();
    this.update();
  }

  /** A picture is on the screen. */
  drawn(): void {
    this.#poster.hidden = true;
    this.wait(undefined);
    const isDue = !this.#engine?.playback.isPlaying || performance.now() - this.#updatedAt > UPDATE_MS;
    if (isDue) this.update();
  }

  update(): void {
    const engine = this.#engine;
    if (engine === undefined || !engine.isOpen) return;
    this.#updatedAt = performance.now();
    const { playback, shown } = engine;
    this.#hasPlayed ||= playback.isPlaying;
    if (this.#hasPlayed) this.#big.hidden = true;
    this.controls.update({
      isPlaying: playback.isPlaying,
      seconds: engine.timeOf(engine.frame),
      duration: engine.timeOf(engine.count - 1),
      end: engine.timeOf(engine.count - 1) + 1 / engine.header.fps,
      speed: playback.speed,
      look: shown.look,
      eyes: shown.eyes.mode,
      isImmersed: engine.immersed !== undefined,
      section: playback.section,
      isGrowing: engine.isGrowing,
    });
    this.#legend.show(engine);
    if (!this.#stats.hidden) this.#stats.textContent = statistics(engine);
  }

  /** Show what is waited for, or that nothing is. */
  wait(what: string | undefined): void {
    this.#wait.hidden = what === undefined;
    if (what !== undefined) this.#wait.textContent = what;
  }

  tell(text: string): void {
    this.#notice.tell(text);
  }

  /** Nothing can be shown. */
  fail(text: string): void {
    this.#notice.tell(text, button(TEXTS.openFile, TEXTS.openFile, () => this.openFile()));
    this.#idle.end();
  }

  endSway(): void {
    this.#isTouched = true;
    this.#hint.hidden = true;
    this.looking.endSway();
    this.#idle.end();
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
    const engine = this.#engine;
    if (!engine?.isOpen) return;
    const most = mostDolly(engine.header);
    void engine.change({ dolly: Math.min(Math.max(engine.shown.dolly + by * most, 0), most) });
  }

  changeSpeed(speed: number): void {
    this.#engine?.playback.setSpeed(speed);
    this.update();
  }

  get speed(): number {
    return this.#engine?.playback.speed ?? 1;
  }

  /** The loop begins, or ends, at the frame that is shown. */
  markSection(mark: Mark): void {
    const engine = this.#engine;
    if (!engine?.isOpen) return;
    engine.playback.section = this.#section.mark(mark, engine.timeOf(engine.shown.frame), engine.timeOf(engine.count - 1));
    this.update();
  }

  nextLook(): void {
    const engine = this.#engine;
    if (!engine?.isOpen) return;
    const looks = LOOKS.filter((name) => name !== "difference" || engine.originals !== undefined);
    const look = looks[(looks.indexOf(engine.shown.look) + 1) % looks.length];
    void engine.change({ look });
    this.#spoken.textContent = TEXTS.looks[look];
    this.update();
  }

  nextEyes(): void {
    const engine = this.#engine;
    if (!engine?.isOpen) return;
    const mode = EYE_MODES[(EYE_MODES.indexOf(engine.shown.eyes.mode) + 1) % EYE_MODES.length];
    void engine.change({ eyes: { ...engine.shown.eyes, mode } });
    this.#spoken.textContent = TEXTS.eyes[mode];
    this.update();
  }

  /** Follow the pointer, or not. */
  toggleHover(): void {
    this.looking.hovers = !this.looking.hovers;
    this.#spoken.textContent = this.looking.hovers ? TEXTS.follows : TEXTS.followsNot;
  }

  toggleStatistics(): void {
    this.#stats.hidden = !this.#stats.hidden;
    this.update();
  }

  toggleFullscreen(): void {
    if (document.fullscreenElement !== null) void document.exitFullscreen();
    else void this.#host.requestFullscreen?.().catch(() => {}); // not allowed within some pages
  }

  showHelp(): void {
    this.#dialog.showModal();
  }

  openFile(): void {
    this.#incoming.input.click();
  }

  savePicture(): void {
    const engine = this.#engine;
    if (engine?.isOpen) void savePicture(engine.pixels(), `${engine.header.name || "view"}-${engine.frame}`);
  }

  async saveClip(): Promise<void> {
    const engine = this.#engine;
    if (!engine?.isOpen) return;
    this.tell(TEXTS.recording);
    await saveLoop(engine, this.#canvas);
    this.#notice.hide();
  }

  async copyLink(): Promise<void> {
    const engine = this.#engine;
    if (!engine?.isOpen) return;
    const link = linkTo(engine.shown.view, engine.timeOf(engine.frame));
    await navigator.clipboard.writeText(link).then(() => this.tell(TEXTS.linkCopied), () => this.tell(link));
  }

  /** Into the headset, or out of it. */
  async toggleHeadset(): Promise<void> {
    const engine = this.#engine;
    if (!engine?.isOpen) return;
    if (engine.immersed !== undefined) engine.leave();
    else await engine.immerse().catch((error: Error) => this.tell(TEXTS.noHeadset(error.message)));
  }

  #actions() {
    return {
      togglePlay: () => this.togglePlay(),
      step: (by: number) => this.step(by),
      seekTo: (seconds: number) => this.seekTo(seconds),
      setSpeed: (speed: number) => this.changeSpeed(speed),
      setLook: (look: (typeof LOOKS)[number]) => void this.#engine?.change({ look }),
      setEyes: (mode: (typeof EYE_MODES)[number]) => void this.#engine?.change({ eyes: { mode, distance: 0.5 } }),
      setWipe: (wipe: number) => void this.#engine?.change({ wipe }),
      setFocus: (focus: number | undefined) => void this.#engine?.change({ focus }),
      savePicture: () => this.savePicture(),
      saveClip: () => void this.saveClip(),
      copyLink: () => void this.copyLink(),
      openFile: () => this.openFile(),
      toggleFullscreen: () => this.toggleFullscreen(),
      followTilt: async () => {
        const isAllowed = await Tilt.ask();
        if (!isAllowed) this.tell(TEXTS.tiltRefused);
        return isAllowed;
      },
      toggleHeadset: () => void this.toggleHeadset(),
      showHelp: () => this.showHelp(),
      peek: async (seconds: number) => this.#engine?.peek(seconds, PEEK_PX),
    };
  }

  #hover(at: { x: number; y: number } | undefined): void {
    const engine = this.#engine;
    if (!engine?.isOpen) return;
    this.#probe.hide();
    if (at === undefined || !this.looking.hovers) return;
    this.endSway();
    this.looking.hover(at.x - 0.5, at.y - 0.5);
    if (!engine.playback.isPlaying && engine.shown.look !== "picture") this.#probe.show(engine, at, this.#stage.getBoundingClientRect());
  }

  #click(): void {
    if (!this.controls.menu.hidden) this.controls.toggleMenu(false);
    else this.togglePlay();
  }

  #key(event: KeyboardEvent): void {
    const action = this.#keys.get(event.key);
    if (action === undefined || this.#dialog.open || isForControl(event)) return;
    event.preventDefault();
    this.endSway();
    action();
  }
}
