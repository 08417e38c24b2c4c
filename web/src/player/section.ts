/** The loop between two marks, A and B: each can be set, and set again where it is to end the loop. */

export type Mark = "from" | "to";

/** Seconds. */
export interface Section {
  readonly from: number;
  readonly to: number;
}

export class Marks {
  #marks: { from: number | undefined; to: number | undefined } = { from: undefined, to: undefined };

  /** Set a mark at some seconds; where it is there already, or behind the other one, the loop ends. */
  mark(which: Mark, seconds: number, duration: number): Section | undefined {
    const isThere = this.#marks[which] !== undefined && Math.abs(this.#marks[which] - seconds) < 1e-6;
    if (!isThere) this.#marks[which] = seconds;
    const section = { from: this.#marks.from ?? 0, to: this.#marks.to ?? duration };
    if (isThere || section.from >= section.to) {
      this.#marks = { from: undefined, to: undefined };
      return undefined;
    }
    return section;
  }
}
