// The player: what the viewer wants, what the server shows, and the controls between the two.

import { Connection } from "./connection.js";
import { Controls, LOOKS, STEREO } from "./controls.js";
import { Hover } from "./hover.js";
import { copyLink, savePicture } from "./keep.js";
import { drawLegend } from "./legend.js";
import { Link, readLink } from "./link.js";
import { ArrayMap } from "./map.js";
import { Section } from "./section.js";
import { Stage } from "./stage.js";
import { Stats } from "./stats.js";
import { Sway } from "./sway.js";
import { damageText, showQuality } from "./told.js";

const NUDGE = 0.25; // steps of the grid
const EYES_STEP = 0.05;
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];
const NOTICE_MS = 10000;
const IDLE_MS = 3000;
const HINT_MS = 4000;
const SKIP_S = 5;

const $ = (id) => document.getElementById(id);
// 0:07.3
const clock = (seconds) => {
  const tenths = Math.floor(10 * Math.max(seconds, 0) + 0.001);
  return `${Math.floor(tenths / 600)}:${String(Math.floor(tenths / 10) % 60).padStart(2, "0")}.${tenths % 10}`;
};
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

class Player {
  constructor() {
    this.facts = null;
    this.wanted = { frame: 0, row: null, col: null, look: "picture", eyes: null, dolly: 0, wipe: 0, measure: false, ...readLink() };
    this.isViewGiven = this.wanted.row !== null;
    this.playback = { playing: false, speed: 1, loop: false, section: null };
    this.section = new Section();
    this.sway = new Sway((row, col) => this.moveTo(row, col));
    this.shown = null;
    this.moveDue = false;
    this.link = new Link();
    this.stats = new Stats($("stats"));
    this.map = new ArrayMap($("map"), (row, col) => this.moveTo(row, col));
    this.stage = new Stage($("stage"), {
      touched: () => this.touched(),
      moved: (rows, cols) => this.drag(rows, cols),
      ahead: (by) => this.goAhead(by),
      hovered: (at) => this.hover.move(at),
      clicked: () => this.togglePlay(),
      doubleClicked: () => this.toggleFullscreen(),
    });
    this.hover = new Hover(this, $("probe"));
    this.drawing = Promise.resolve();
    this.controls = new Controls(this);
    this.connection = new Connection(this);
  }

  // What the server says

  hello(facts) {
    const first = this.facts === null;
    this.facts = facts;
    document.title = `${facts.title} – mvcodec`;
    $("title").textContent = `${facts.title} · ${facts.synthesizer}`;
    const { wanted } = this;
    wanted.row = clamp(wanted.row ?? (facts.rows - 1) / 2, 0, facts.rows - 1);
    wanted.col = clamp(wanted.col ?? (facts.cols - 1) / 2, 0, facts.cols - 1);
    wanted.eyes = clamp(wanted.eyes ?? 0.5, 0, facts.cols - 1);
    wanted.frame = clamp(wanted.frame, 0, facts.frames - 1);
    if (!facts.looks.includes(wanted.look)) wanted.look = "picture";
    this.map.build(facts);
    this.controls.fill();
    const { send } = this;
    send("move", { row: wanted.row, col: wanted.col });
    send("seek", { frame: wanted.frame });
    send("show", { look: wanted.look });
    send("eyes", { steps: wanted.eyes });
    send("dolly", { share: wanted.dolly });
    send("wipe", { share: wanted.wipe });
    send("measure", { measure: wanted.measure });
    send("speed", { factor: this.playback.speed });
    send("loop", { loop: this.playback.loop });
    const { section } = this.playback;
    if (section) send("section", { first: section[0], last: section[1] });
    if (!first && this.playback.playing) send("play", { playing: true });
    send("ready");
    $("connection").hidden = true;
    document.body.classList.remove("away");
    if (!first) this.say("Connected again");
    if (facts.cut_off) this.warn(facts.cut_off);
  }

  send = (type, fields) => this.connection.send(type, fields);

  state({ playing, speed, loop, section }) {
    this.playback = { playing, speed, loop, section };
    this.controls.showPlayback();
  }

  trouble({ message }) {
    this.warn(message);
  }

  place(found) {
    this.hover.answered(found);
  }

  picture(facts, blob) {
    // One after the other: two bitmaps decoded at once may be done in the wrong order.
    this.drawing = this.drawing
      .then(() => this.stage.draw(blob))
      .then(() => {
        this.shown = facts;
        this.send("shown", { picture: facts.picture });
        this.stats.note(facts);
        this.showFacts();
      })
      .catch((error) => {
        // The next one is drawn all the same, and the server waits for no answer about this one.
        this.send("shown", { picture: facts.picture });
        this.warn(`Frame ${facts.frame} cannot be drawn: ${error.message}`);
      });
  }

  away(reason) {
    $("connection").textContent = `${reason} Trying again …`;
    $("connection").hidden = false;
    this.hover.forget();
    document.body.classList.add("away");
  }

  // What the viewer wants

  drag(rows, cols) {
    const { facts, wanted } = this;
    if (facts) this.moveTo(wanted.row + rows * (facts.rows - 1), wanted.col + cols * (facts.cols - 1));
  }

  // Ahead into the picture, or back, by a share of the farthest.
  goAhead(by) {
    if (!this.facts) return;
    this.wanted.dolly = clamp(this.wanted.dolly + by, 0, 1);
    this.send("dolly", { share: this.wanted.dolly });
  }

  nudge(rows, cols) {
    const { wanted } = this;
    this.moveTo(wanted.row + NUDGE * rows, wanted.col + NUDGE * cols);
    this.say(`row ${wanted.row.toFixed(2)}, column ${wanted.col.toFixed(2)}`);
  }

  snap() {
    this.moveTo(Math.round(this.wanted.row), Math.round(this.wanted.col));
  }

  moveTo(row, col, hovers = false) {
    const { facts, wanted } = this;
    if (!facts) return;
    wanted.row = clamp(row, 0, facts.rows - 1);
    wanted.col = clamp(col, 0, facts.cols - 1);
    if (!hovers) this.hover.settle();
    if (this.moveDue) return;
    // The latest place wins: one message for each picture of the screen at most.
    this.moveDue = true;
    requestAnimationFrame(() => {
      this.moveDue = false;
      this.send("move", { row: wanted.row, col: wanted.col });
      this.map.show(this.shown ?? wanted, wanted);
    });
  }

  togglePlay() {
    this.send("play", { playing: !this.playback.playing });
  }

  step(frames) {
    if (this.playback.playing) this.send("play", { playing: false });
    this.send("step", { frames });
  }

  // By some seconds, or a tenth of a short file.
  skip(direction) {
    const { facts, shown } = this;
    if (!facts || !shown) return;
    const duration = facts.last_s - facts.first_s;
    const seconds = Math.min(SKIP_S, Math.max(duration / 10, 0.1));
    this.seek(shown.frame + direction * Math.max(Math.round((seconds * (facts.frames - 1)) / Math.max(duration, 0.001)), 1));
  }

  seek(frame) {
    if (!this.facts) return;
    this.send("seek", { frame: clamp(frame, 0, this.facts.frames - 1) });
  }

  // The loop begins (0), or ends (1), at the frame that is shown.
  mark(which) {
    if (!this.facts || !this.shown) return;
    const last = this.facts.frames - 1;
    const section = this.section.mark(which, this.shown.frame, last) ?? [0, last];
    this.send("section", { first: section[0], last: section[1] });
  }

  toggleLoop() {
    this.send("loop", { loop: !this.playback.loop });
  }

  setSpeed(factor) {
    this.send("speed", { factor });
  }

  changeSpeed(by) {
    const place = SPEEDS.findIndex((speed) => speed >= this.playback.speed);
    this.setSpeed(SPEEDS[clamp(place + by, 0, SPEEDS.length - 1)]);
  }

  // What is shown of one view, or how many views.
  nextLook() {
    this.showNext(this.facts.looks.filter((look) => !STEREO.includes(look)));
  }

  nextEyes() {
    this.showNext(["picture", ...STEREO]);
  }

  showNext(looks) {
    this.setLook(looks[(looks.indexOf(this.wanted.look) + 1) % looks.length]);
  }

  setLook(look) {
    this.wanted.look = look;
    this.send("show", { look });
    this.say(LOOKS[look]);
    this.controls.showLook();
  }

  changeEyes(by) {
    this.setEyes(this.wanted.eyes + by * EYES_STEP);
  }

  setEyes(steps) {
    if (!this.facts) return;
    this.wanted.eyes = clamp(Math.round(steps / EYES_STEP) * EYES_STEP, 0, this.facts.cols - 1);
    this.send("eyes", { steps: this.wanted.eyes });
    this.controls.showLook();
  }

  setWipe(share) {
    this.wanted.wipe = share;
    this.send("wipe", { share });
  }

  toggleMeasure() {
    if (!this.facts?.measurable) {
      this.warn("There is nothing to measure against: start with --original ARRAY");
      return;
    }
    this.wanted.measure = !this.wanted.measure;
    this.send("measure", { measure: this.wanted.measure });
    $("measure").setAttribute("aria-pressed", this.wanted.measure);
  }

  toggleFullscreen() {
    if (document.fullscreenElement) document.exitFullscreen();
    else document.documentElement.requestFullscreen().catch(() => this.warn("This browser refuses full screen"));
  }

  toggleStatistics() {
    $("stats").hidden = !$("stats").hidden;
  }

  savePicture() {
    if (this.shown) savePicture(this.stage.canvas, `${this.facts.title.replace(/\.mcap$/, "")}-${this.shown.frame}`);
  }

  copyLink() {
    copyLink(this.link.wanted, (text) => this.warn(text));
  }

  toggleHelp() {
    if ($("help").open) $("help").close();
    else $("help").showModal();
  }

  followLink() {
    const link = readLink();
    if (!this.facts || location.hash === this.link.wanted) return;
    if (link.frame !== undefined) this.seek(link.frame);
    if (link.row !== undefined) this.moveTo(link.row, link.col);
    if (link.eyes !== undefined) this.setEyes(link.eyes);
    if (link.look === undefined || link.look in LOOKS) this.setLook(link.look ?? "picture");
  }

  // What is on the screen

  showFacts() {
    const { facts, shown, wanted } = this;
    wanted.frame = shown.frame;
    if (!$("wait").hidden) this.firstShown();
    // The last frame is shown until the end.
    const time = `${clock(shown.time_s - facts.first_s)} / ${clock(facts.last_s - facts.first_s + 1 / facts.fps)}`;
    this.controls.showTime(time, shown.frame);
    this.map.show(shown, wanted);
    drawLegend($("legend"), shown.legend);
    showQuality($("quality"), shown.quality);
    if (shown.damage) this.warn(damageText(shown));
    if (!this.sway.isOn) this.link.write({ ...shown, eyes: wanted.eyes }, STEREO.includes(shown.look));
    const { look, frame, row, col, dolly, wipe, scale, quick } = shown;
    Object.assign(document.body.dataset, { look, frame, row, col, dolly, wipe, scale, quick });
  }

  firstShown() {
    $("wait").hidden = true;
    $("big").hidden = this.facts.frames < 2 || this.playback.playing;
    if (this.isTouched || this.facts.rows * this.facts.cols < 2) return;
    const isStill = matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (!isStill && !this.isViewGiven) this.sway.begin(this.facts);
    $("hint").hidden = false;
    setTimeout(() => ($("hint").hidden = true), HINT_MS);
  }

  // Somebody takes over: no more hint, and no sway.
  touched() {
    this.isTouched = true;
    this.sway.end();
    $("hint").hidden = true;
  }

  warn(text) {
    if ($("notice-text").textContent !== text) $("notice-text").textContent = text;
    $("notice").hidden = false;
    clearTimeout(this.warning);
    this.warning = setTimeout(() => ($("notice").hidden = true), NOTICE_MS);
  }

  // Somebody is there: the controls show.
  stir() {
    document.body.classList.remove("idle");
    clearTimeout(this.idling);
    this.idling = setTimeout(() => document.body.classList.add("idle"), IDLE_MS);
  }

  say(text) {
    $("spoken").textContent = text;
  }

}

new Player();
