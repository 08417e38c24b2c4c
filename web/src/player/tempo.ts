/** How much detail a moving picture gets: less where the pictures come too slowly. */

/** Pictures are to come at least so often, ms; more detail is tried where they come so much sooner. */
const SLOW_MS = 33;
const FAST_MS = 21;
/** The same while nothing but frames changes the picture, in times between two frames. */
const LATE = 1.3;
const IN_TIME = 1.1;
/** A longer pause is none of the GPU's. */
const PAUSE_MS = 400;
/** Share of the newest interval in the mean. */
const NEWEST = 0.25;
/** Pictures after which less detail is taken, and more is tried: twice as many after each time that it was too much. */
const FALL_AFTER = 6;
const RISE_AFTER = 60;
const MOST_PATIENCE = 16 * RISE_AFTER;
/** Smaller ones would hardly be made sooner: what the browser does with any picture takes longer. */
const DETAILS = [1, 0.75, 0.5, 0.375] as const;

export class Tempo {
  #level = 0;
  #last: number | undefined;
  #mean = FAST_MS;
  /** Pictures since the level changed. */
  #count = 0;
  #patience = RISE_AFTER;
  /** This level came by trying more. */
  #isTried = false;
  #isInTime = true;

  /** Of the picture's size each way. */
  get detail(): number {
    return DETAILS[this.#level];
  }

  /** Whether moving pictures may be as fine as one that stands, which took `costMs`; undefined: none has stood yet. */
  allowsFine(costMs: number | undefined): boolean {
    return costMs !== undefined && costMs < FAST_MS && this.#level === 0 && this.#isInTime && this.#count > RISE_AFTER / 2;
  }

  /** Mean time between pictures while they move, ms. */
  get interval(): number {
    return this.#mean;
  }

  /** A picture was drawn while it moves; `periodMs`: when the next one is due where only frames change it, else 0. */
  drawn(now: number, periodMs: number): void {
    const interval = this.#last === undefined ? undefined : now - this.#last;
    this.#last = now;
    if (interval === undefined || interval > PAUSE_MS + periodMs) return;
    this.#mean += NEWEST * (interval - this.#mean);
    this.#count++;
    this.#isInTime = this.#mean < Math.max(FAST_MS, IN_TIME * periodMs);
    if (this.#count < FALL_AFTER) return;
    if (this.#mean > Math.max(SLOW_MS, LATE * periodMs) && this.#level < DETAILS.length - 1) {
      if (this.#isTried && this.#count < RISE_AFTER) this.#patience = Math.min(2 * this.#patience, MOST_PATIENCE);
      this.#change(1);
    } else if (this.#isInTime && this.#level > 0 && this.#count > this.#patience) this.#change(-1);
  }

  /** The picture stands: the next interval is no measure. */
  rest(): void {
    this.#last = undefined;
  }

  #change(by: number): void {
    this.#level += by;
    this.#isTried = by < 0;
    this.#count = 0;
    this.#mean = 0.5 * (SLOW_MS + FAST_MS);
  }
}
