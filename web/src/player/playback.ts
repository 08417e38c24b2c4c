/** Which time of the recording is due: play, pause, speed, and a loop between two times. All in seconds. */

import type { Section } from "./section.ts";

export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4] as const;

export class Playback {
  isPlaying = false;
  /** Begin again at the end. */
  loops = true;
  speed = 1;
  /** What is played over and over; undefined: everything. */
  section: Section | undefined;
  #end = 0;
  #at = 0;
  #since: number | undefined;

  setEnd(seconds: number): void {
    this.#end = seconds;
  }

  play(from: number): void {
    this.isPlaying = true;
    this.moveTo(from >= this.#end - 1e-9 ? (this.section?.from ?? 0) : from);
  }

  pause(): void {
    this.isPlaying = false;
    this.#since = undefined;
  }

  /** Go on from another time. */
  moveTo(seconds: number): void {
    this.#at = seconds;
    this.#since = undefined;
  }

  setSpeed(speed: number): void {
    this.speed = Math.min(Math.max(speed, SPEEDS[0]), SPEEDS[SPEEDS.length - 1]);
  }

  /** The time that is due; `now` in ms of any clock. Pauses itself behind the end where nothing loops. */
  timeAt(now: number): number {
    if (this.#since !== undefined) this.#at += ((now - this.#since) / 1000) * this.speed;
    this.#since = now;
    const from = this.section?.from ?? 0;
    const to = Math.min(this.section?.to ?? this.#end, this.#end);
    if (this.#at >= to) {
      if (this.loops || this.section !== undefined) this.#at = from + ((this.#at - from) % Math.max(to - from, 1e-3));
      else {
        this.#at = Math.max(to - 1e-3, from);
        this.pause();
      }
    }
    return this.#at;
  }
}
