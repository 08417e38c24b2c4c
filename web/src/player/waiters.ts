/** Those who wait until something holds of what is on the screen. */

export class Waiters {
  #waiting: { isDone: () => boolean; resolve: () => void }[] = [];

  /** Resolves with the first `look` that finds it done, or with `releaseAll`. */
  until(isDone: () => boolean): Promise<void> {
    return new Promise((resolve) => this.#waiting.push({ isDone, resolve }));
  }

  look(): void {
    this.#waiting = this.#waiting.filter(({ isDone, resolve }) => !isDone() || void resolve());
  }

  releaseAll(): void {
    this.#waiting.splice(0).forEach(({ resolve }) => resolve());
  }
}
