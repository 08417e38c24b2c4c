/** When a moving picture comes to stand, so that it is worth all detail. */

/** Nothing has changed for so long. */
const STANDS_MS = 120;
/** The same where pictures in all detail take long: one that comes too early holds up whoever still moves. */
const LONGEST_MS = 1000;

/** Share of a picture's sides that is drawn to guess how long a whole one takes; where the part takes longer, the whole does too. */
export const PART = 0.25;
const PART_MS = 25;

export class Standing {
  readonly #onStands: () => void;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #isHeld = false;
  #isDue = false;
  /** How long the last picture in all detail took; undefined before the first one. */
  costMs: number | undefined;

  constructor(onStands: () => void) {
    this.#onStands = onStands;
  }

  /** How long nothing must change, ms. */
  get patience(): number {
    return Math.min(Math.max(STANDS_MS, this.costMs ?? 0), LONGEST_MS);
  }

  /** Something has changed. */
  moved(): void {
    clearTimeout(this.#timer);
    this.#isDue = this.#isHeld;
    if (this.#isHeld) return;
    this.#timer = setTimeout(() => this.#onStands(), this.patience);
  }

  /** Somebody holds the picture: it does not stand until it is let go. */
  hold(isHeld: boolean): void {
    this.#isHeld = isHeld;
    if (isHeld || this.#isDue) this.moved();
  }

  /** A picture in all detail took so long, ms. */
  took(ms: number): void {
    this.costMs = ms;
  }

  /** A picture in all detail has been begun: those who move on at once should not wait for it again. */
  async time(drawn: Promise<void>): Promise<void> {
    const since = performance.now();
    await drawn;
    this.took(performance.now() - since);
  }

  /** As long as nothing has stood: guess by a part of such a picture, which `draw` begins; whether it may be quick enough to be worth a whole one. */
  async guess(draw: () => Promise<void>): Promise<boolean> {
    const since = performance.now();
    await draw();
    const ms = performance.now() - since;
    if (ms > PART_MS) this.costMs ??= ms / PART ** 2;
    return ms <= PART_MS;
  }

  close(): void {
    clearTimeout(this.#timer);
  }
}
