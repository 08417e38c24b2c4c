/** Pictures in the last second. */

const WINDOW_MS = 1000;

export class Rate {
  #times: number[] = [];

  note(now: number): void {
    this.#times.push(now);
    this.#times = this.#times.filter((time) => now - time <= WINDOW_MS);
  }

  get perSecond(): number {
    const now = performance.now();
    return this.#times.filter((time) => now - time <= WINDOW_MS).length;
  }
}
