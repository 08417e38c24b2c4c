/** Controls that hide when nothing happens for a while. */

import type { Controls } from "./controls.ts";

const IDLE_MS = 3000;

export class Idle {
  readonly #stage: HTMLElement;
  readonly #controls: Controls;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(stage: HTMLElement, controls: Controls) {
    this.#stage = stage;
    this.#controls = controls;
  }

  /** Something has happened. */
  end(): void {
    this.#stage.classList.remove("idle");
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#begin(), IDLE_MS);
  }

  close(): void {
    clearTimeout(this.#timer);
  }

  #begin(): void {
    const { bar, menu } = this.#controls;
    const hasFocus = bar.matches(":focus-within") && bar.querySelector(":focus-visible") !== null;
    if (!hasFocus && menu.hidden && !bar.matches(":hover")) this.#stage.classList.add("idle");
  }
}
