/** What surrounds the picture: controls, gestures, keys, messages; and how they act on the engine. */

import type { Header } from "../container/header.ts";
import { ArrayMap } from "./array_map.ts";
import { Commands } from "./commands.ts";
import { Controls } from "./controls.ts";
import { button, element, icon } from "./dom.ts";
import type { Engine } from "./engine.ts";
import { Gestures } from "./gestures.ts";
import { hasHeadset } from "./immersive.ts";
import { Idle } from "./idle.ts";
import { Incoming } from "./incoming.ts";
import { isForControl, keyActions, keyList } from "./keys.ts";
import { LegendBox } from "./legend.ts";
import { Notice } from "./notice.ts";
import { Probe } from "./probe.ts";
import { TEXTS } from "./texts.ts";
import { Tilt } from "./tilt.ts";

const HINT_MS = 4000;
/** While it plays, what stands beside the picture changes no more often: each change costs as much as a picture where there is no GPU. */
const UPDATE_MS = 200;

export class Ui {
  readonly #host: HTMLElement;
  readonly #stage = element("div", { class: "stage", tabindex: "0", role: "application", "aria-label": TEXTS.stage });
  readonly #wait = element("p", { class: "wait", role: "status", hidden: true });
  readonly #big = button(TEXTS.play, icon("play"), () => this.commands.togglePlay());
  readonly #hint = element("p", { class: "hint", hidden: true }, TEXTS.hint);
  readonly #notice = new Notice();
  readonly #stats = element("pre", { class: "stats", hidden: true });
  readonly #probe = new Probe();
  readonly #spoken = element("p", { class: "unseen", role: "status" });
  readonly #dialog = keyList();
  readonly #incoming: Incoming;
  readonly #legend = new LegendBox();
  readonly #map = new ArrayMap((view) => {
    this.endSway();
    this.commands.looking.go(view);
  });
  readonly #poster = element("img", { class: "poster", alt: "", hidden: true });
  readonly commands = new Commands({
    update: () => this.update(),
    say: (text) => (this.#spoken.textContent = text),
    tell: (text) => (text === undefined ? this.#notice.hide() : this.tell(text)),
  });
  readonly controls: Controls;
  readonly #keys: ReturnType<typeof keyActions>;
  #gestures: Gestures | undefined;
  #engine: Engine | undefined;
  #isTouched = false;
  #hasPlayed = false;
  #updatedAt = 0;
  readonly #idle: Idle;
  /** The controls were hidden when the picture was touched last. */
  #wasIdle = false;
  /** What stands above the bar must know how many rows it has. */
  readonly #barSize = new ResizeObserver(() => {
    for (const box of [this.#map.box, this.controls.menu]) box.style.setProperty("--bar", `${this.controls.bar.offsetHeight}px`);
  });
  #stop = new AbortController();

  constructor(host: HTMLElement, root: ShadowRoot, open: (from: Blob) => void) {
    this.#host = host;
    this.#incoming = new Incoming(open);
    this.controls = new Controls(this.commands, this);
    this.#idle = new Idle(this.#stage, [this.controls.bar, this.#map.box], this.controls.menu);
    this.#keys = keyActions(this);
    this.#big.classList.add("big", "fills");
    this.#big.hidden = true;
    this.#stage.append(this.#poster);
    const middle = element("div", { class: "middle" }, this.#wait, this.#big);
    const top = element("div", { class: "top" }, this.#stats, this.#notice.box, this.#legend.box);
    root.append(this.#stage, middle, this.#hint, top, this.#probe.label, this.#map.box, this.controls.bar, this.controls.menu,
      this.#spoken, this.#dialog, this.#incoming.input);
  }

  connect(): void {
    this.#stop = new AbortController();
    const { signal } = this.#stop;
    this.#gestures = new Gestures(this.#stage, {
      onTouch: () => {
        this.#wasIdle = this.#idle.isOn;
        this.endSway();
      },
      onHold: (isHeld) => this.#engine?.hold(isHeld),
      onDrag: (across, down) => this.commands.looking.drag(across, down),
      onHover: (at) => this.#hover(at),
      onDolly: (by) => this.commands.dolly(by),
      onClick: (isFinger) => this.#click(isFinger),
      onDoubleClick: () => this.toggleFullscreen(),
    });
    // The page listens everywhere, an element within another page only where it has the focus.
    const keyboard: EventTarget = this.#host.hasAttribute("page") ? document : this.#host;
    keyboard.addEventListener("keydown", (event) => this.#key(event as KeyboardEvent), { signal });
    for (const name of ["pointermove", "focusin"]) this.#host.addEventListener(name, () => this.#idle.end(), { signal });
    this.#incoming.listen(this.#host, signal);
    this.#barSize.observe(this.controls.bar);
    new Tilt((right, down) => this.commands.looking.turn(right, down)).listen(signal);
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
    this.#barSize.disconnect();
    this.#gestures?.close();
    this.#idle.close();
  }

  attach(engine: Engine): void {
    this.#engine?.canvas.remove();
    this.#engine = engine;
    this.#stage.prepend(engine.canvas);
    this.commands.attach(engine);
    this.controls.enable(false);
    this.#notice.hide();
    this.#hasPlayed = false;
  }

  /** The first picture is there. */
  opened(isViewGiven: boolean): void {
    const engine = this.#engine!;
    this.controls.offer(engine);
    this.#map.build(engine);
    this.controls.enable(true);
    this.#big.hidden = engine.count < 2 || this.#host.hasAttribute("autoplay");
    const lacking = whatIsLacking(engine.header);
    if (lacking !== undefined) this.tell(lacking);
    const isStill = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const sways = !this.#isTouched && !isViewGiven && !isStill;
    this.commands.looking.attach(engine, sways);
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
      distance: shown.eyes.distance,
      section: playback.section,
      isGrowing: engine.isGrowing,
    });
    this.#legend.show(engine.legend);
    this.#map.show(engine.view);
    if (!this.#stats.hidden) this.#stats.textContent = engine.statistics;
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
    this.commands.looking.endSway();
    this.#idle.end();
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

  #hover(at: { x: number; y: number } | undefined): void {
    const engine = this.#engine;
    if (!engine?.isOpen) return;
    this.#probe.hide();
    if (at === undefined) return;
    const { looking } = this.commands;
    if (looking.hovers) {
      this.endSway();
      looking.hover(at.x - 0.5, at.y - 0.5);
    }
    if (!engine.playback.isPlaying && engine.shown.look !== "picture") void this.#probe.show(engine, at, this.#stage.getBoundingClientRect());
  }

  /** A finger's tap shows the controls and hides them, since nothing else would. */
  #click(isFinger: boolean): void {
    if (!this.controls.menu.hidden) this.controls.toggleMenu(false);
    else if (isFinger) {
      if (!this.#wasIdle) this.#idle.begin();
    } else this.commands.togglePlay();
  }

  #key(event: KeyboardEvent): void {
    const action = this.#keys.get(event.key);
    if (action === undefined || this.#dialog.open || isForControl(event)) return;
    event.preventDefault();
    this.endSway();
    action(event.shiftKey);
  }
}

/** What this page cannot show of a file. */
function whatIsLacking({ predicted, mapCameras, enhancedViews }: Header): string | undefined {
  if (predicted.length > 0) return TEXTS.predicted(predicted.length);
  if (mapCameras === "none") return TEXTS.noMaps;
  return enhancedViews > 0 ? TEXTS.enhanced(enhancedViews) : undefined;
}
