/** Controls that hide when nothing happens for a while. */

const IDLE_MS = 3000;

export class Idle {
  readonly #stage: HTMLElement;
  readonly #bars: readonly HTMLElement[];
  readonly #menu: HTMLElement;
  #timer: ReturnType<typeof setTimeout> | undefined;

  /** `bars` stay while they are pointed at, or have the focus from the keyboard, and all while the menu is open. */
  constructor(stage: HTMLElement, bars: readonly HTMLElement[], menu: HTMLElement) {
    this.#stage = stage;
    this.#bars = bars;
    this.#menu = menu;
  }

  /** Something has happened. */
  end(): void {
    this.#stage.classList.remove("idle");
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.begin(), IDLE_MS);
  }

  close(): void {
    clearTimeout(this.#timer);
  }

  get isOn(): boolean {
    return this.#stage.classList.contains("idle");
  }

  /** Hide now, unless something is used. */
  begin(): void {
    const isUsed = this.#bars.some((bar) => bar.matches(":hover") || bar.querySelector(":focus-visible") !== null);
    if (!isUsed && this.#menu.hidden) this.#stage.classList.add("idle");
  }
}
