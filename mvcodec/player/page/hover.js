// The pointer over the picture, without being pressed: the view follows it, if somebody wants that, and it is said what is under it.

import { STEREO } from "./controls.js";

const SHARE = 0.3; // of the array, that the pointer looks around from edge to edge

export class Hover {
  constructor(player, label) {
    this.player = player;
    this.label = label;
    this.home = null; // where the view looks around from; null: it does not follow the pointer
    this.wanted = null; // the place that is to be told about
    this.asked = null; // the one that the server was asked about
  }

  toggle() {
    this.home = this.home ? null : this.here();
    this.player.say(this.home ? "The view follows the pointer" : "The view does not follow the pointer");
  }

  // The view went elsewhere by other means.
  settle() {
    if (this.home) this.home = this.here();
  }

  here() {
    const { row, col } = this.player.wanted;
    return { row, col };
  }

  // `at`: in shares of the picture from its upper left; null: the pointer left it.
  move(at) {
    const { facts, shown, stage } = this.player;
    if (!facts || !shown) return;
    const isInside = at !== null && Math.min(at.x, at.y) >= 0 && Math.max(at.x, at.y) <= 1;
    this.tell(isInside ? at : null, stage);
    if (!this.home || !isInside) return;
    const [down, across] = [(at.y - 0.5) * SHARE * (facts.rows - 1), (at.x - 0.5) * SHARE * (facts.cols - 1)];
    this.player.moveTo(this.home.row + down, this.home.col + across, true);
  }

  // What is under the pointer is asked of the server, one place at a time, while the picture stands and shows no colours of its own.
  tell(at, stage) {
    const { playback, wanted } = this.player;
    const isTold = at !== null && !playback.playing && ![...STEREO, "picture"].includes(wanted.look);
    this.wanted = isTold ? at : null;
    this.label.hidden ||= !isTold;
    if (!isTold) return;
    const { x, y } = stage.windowPx(at);
    [this.label.style.left, this.label.style.top] = [`${x + 14}px`, `${y + 14}px`];
    if (this.asked === null) this.ask();
  }

  ask() {
    this.asked = this.wanted;
    this.player.send("probe", { x: this.asked.x, y: this.asked.y });
  }

  answered({ disparity_px, depth_m }) {
    const isNewest = this.asked === this.wanted;
    this.asked = null;
    if (this.wanted === null) return;
    this.label.textContent = `${disparity_px.toFixed(1)} px${depth_m === null ? "" : `, ${depth_m.toFixed(2)} m`}`;
    this.label.hidden = false;
    if (!isNewest) this.ask();
  }

  // The connection is gone, and with it what was asked.
  forget() {
    this.asked = null;
  }
}
