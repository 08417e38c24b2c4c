/** How much detail a moving picture gets: less where the pictures come too slowly. */

/** Pictures are to come at least so often. */
const SLOW_MS = 42;
const FAST_MS = 21;
/** A longer pause is none of the GPU's. */
const PAUSE_MS = 400;
/** Share of the newest interval in the mean. */
const NEWEST = 0.25;
const DETAILS = [1, 0.75, 0.5, 0.375] as const;

export class Tempo {
  #level = 0;
  #last: number | undefined;
  #mean = FAST_MS;
  /** Since the level changed. */
  #count = 0;

  /** Of the picture's size each way. */
  get detail(): number {
    return DETAILS[this.#level];
  }

  /** Moving pictures may be as fine as those that stand. */
  get isQuick(): boolean {
    return this.#level === 0 && this.#mean < 0.8 * FAST_MS && this.#count > 30;
  }

  /** Mean time between pictures while they move, ms. */
  get interval(): number {
    return this.#mean;
  }

  /** A picture was drawn while it moves. */
  drawn(now: number): void {
    const interval = this.#last === undefined ? undefined : now - this.#last;
    this.#last = now;
    if (interval === undefined || interval > PAUSE_MS) return;
    this.#mean += NEWEST * (interval - this.#mean);
    this.#count++;
    if (this.#count < 6) return;
    if (this.#mean > SLOW_MS && this.#level < DETAILS.length - 1) this.#change(1);
    else if (this.#mean < FAST_MS && this.#level > 0 && this.#count > 60) this.#change(-1);
  }

  /** The picture stands: the next interval is no measure. */
  rest(): void {
    this.#last = undefined;
  }

  #change(by: number): void {
    this.#level += by;
    this.#count = 0;
    this.#mean = 0.5 * (SLOW_MS + FAST_MS);
  }
}
