// The controls: what they ask of the player, and how they show what it does.

import { keyTable, listenForKeys, writeHelp } from "./keys.js";

export const LOOKS = {
  picture: "Picture",
  disparity: "Disparity",
  layers: "Layers",
  provenance: "Cameras that see it",
  difference: "Difference",
  anaglyph: "Red-cyan",
  "side-by-side": "Side by side",
  mosaic: "Nine views",
};
export const STEREO = ["anaglyph", "side-by-side", "mosaic"];

const $ = (id) => document.getElementById(id);

export class Controls {
  constructor(player) {
    this.player = player;
    this.scrubbing = false;
    this.wire();
  }

  // What there is to be seen is known.
  fill() {
    const { facts, wanted } = this.player;
    $("timeline").max = facts.frames - 1;
    $("look").replaceChildren(...facts.looks.map((look) => new Option(LOOKS[look] ?? look, look)));
    $("eyes").max = facts.cols - 1;
    $("eyes").disabled = facts.cols === 1;
    $("measure").hidden = !facts.measurable;
    $("measure").setAttribute("aria-pressed", wanted.measure);
    this.showLook();
    this.showPlayback();
  }

  showLook() {
    const { look, eyes } = this.player.wanted;
    $("look").value = look;
    $("eyes-box").hidden = !STEREO.includes(look);
    $("wipe-box").hidden = look === "picture" || STEREO.includes(look);
    $("eyes").value = eyes;
    $("eyes-value").textContent = eyes.toFixed(2);
  }

  showPlayback() {
    const { playing, speed, loop, section } = this.player.playback;
    this.player.stir();
    if (playing) $("big").hidden = true;
    const button = $("play");
    button.setAttribute("aria-pressed", playing);
    button.setAttribute("aria-label", playing ? "Pause" : "Play");
    button.title = playing ? "Pause (space)" : "Play (space)";
    $("loop").setAttribute("aria-pressed", loop);
    $("speed").value = String(speed);
    $("section").hidden = !section;
    if (!section) return;
    const last = Math.max(this.player.facts.frames - 1, 1);
    $("section").style.left = `${(100 * section[0]) / last}%`;
    $("section").style.width = `${(100 * (section[1] - section[0])) / last}%`;
  }

  // Of the picture on the screen.
  showTime(time, frame) {
    $("time").textContent = time;
    if (!this.scrubbing) $("timeline").value = frame;
    $("timeline").setAttribute("aria-valuetext", time);
  }

  wire() {
    const { player } = this;
    const click = (id, action) => $(id).addEventListener("click", action);
    click("play", () => player.togglePlay());
    click("big", () => player.togglePlay());
    click("back", () => player.step(-1));
    click("on", () => player.step(1));
    click("loop", () => player.toggleLoop());
    click("measure", () => player.toggleMeasure());
    click("open-help", () => player.toggleHelp());
    click("fullscreen", () => player.toggleFullscreen());
    click("notice-close", () => ($("notice").hidden = true));
    // After the mouse, the keys belong to the picture again; whoever came by Tab stays there.
    for (const button of document.querySelectorAll("main button")) {
      button.addEventListener("click", (event) => {
        player.touched();
        if (event.detail) $("stage").focus();
      });
    }
    $("speed").addEventListener("change", () => player.setSpeed(Number($("speed").value)));
    $("look").addEventListener("change", () => player.setLook($("look").value));
    $("eyes").addEventListener("input", () => player.setEyes(Number($("eyes").value)));
    $("wipe").addEventListener("input", () => player.setWipe(Number($("wipe").value)));
    $("timeline").addEventListener("input", () => {
      this.scrubbing = true;
      player.seek(Number($("timeline").value));
    });
    $("timeline").addEventListener("change", () => (this.scrubbing = false));
    document.addEventListener("fullscreenchange", () => $("fullscreen").setAttribute("aria-pressed", Boolean(document.fullscreenElement)));
    window.addEventListener("hashchange", () => player.followLink());
    const table = keyTable(player);
    listenForKeys(table, $("help"), () => player.facts !== null, () => player.touched());
    writeHelp($("keys"), table);
    for (const sign of ["pointermove", "pointerdown", "keydown", "focusin"]) document.addEventListener(sign, () => player.stir());
    document.addEventListener("pointerdown", () => player.touched());
    const controls = $("controls");
    new ResizeObserver(() => document.documentElement.style.setProperty("--controls", `${controls.offsetHeight}px`)).observe(controls);
  }
}
