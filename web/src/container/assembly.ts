/** Messages -> frame sets, in order; says what is missing or out of place. */

import { countEnhanced, parseHeader, type Header } from "./header.ts";
import { HEADER_TOPIC, LAYER_TOPIC, parseVideo, tracksOf, type FrameSet } from "./messages.ts";
import type { TopicMessage } from "./records.ts";

/** What is wrong with a file without ending it, for people. */
export type Tell = (trouble: string) => void;

interface Pending {
  readonly sequence: number;
  readonly timeNs: bigint;
  isKey: boolean;
  readonly units: Map<string, Uint8Array>;
}

export class Assembler {
  header: Header | undefined;
  #topics = new Set<string>();
  #last: { sequence: number; timeNs: bigint } | undefined;
  readonly #tell: Tell;

  constructor(tell: Tell) {
    this.#tell = tell;
  }

  /** Forget what came before: the next frame set may have any number. */
  restart(): void {
    this.#last = undefined;
  }

  /** The frame sets in a chunk's messages. Throws FileError where a header cannot be used. */
  assemble(messages: readonly TopicMessage[]): FrameSet[] {
    const sets: FrameSet[] = [];
    let pending: Pending | undefined;
    for (const message of messages) {
      if (message.topic === HEADER_TOPIC) this.#takeHeader(message);
      else if (message.topic === LAYER_TOPIC && this.header !== undefined) {
        this.header = { ...this.header, enhancedViews: countEnhanced(message.data) };
        continue;
      } else if (!this.#topics.has(message.topic)) continue;
      if (pending === undefined || message.sequence !== pending.sequence) {
        this.#finish(pending, sets);
        pending = { sequence: message.sequence, timeNs: message.timeNs, isKey: false, units: new Map() };
      }
      if (message.topic === HEADER_TOPIC) pending.isKey = true;
      else this.#add(pending, message);
    }
    this.#finish(pending, sets);
    return sets;
  }

  #takeHeader(message: TopicMessage): void {
    const header = parseHeader(message.data);
    if (this.header === undefined) {
      this.header = header;
      this.#topics = new Set(tracksOf(header).map((track) => track.topic));
    } else if (JSON.stringify(header.document) !== JSON.stringify(this.header.document)) {
      this.#tell(`at ${seconds(message.timeNs)}: another header than before; the first one stays`);
    }
  }

  #add(pending: Pending, message: TopicMessage): void {
    if (pending.units.has(message.topic)) {
      this.#tell(`${message.topic} at ${seconds(message.timeNs)}: two messages of one frame set; the first one stays`);
      return;
    }
    try {
      pending.units.set(message.topic, parseVideo(message.data));
    } catch (error) {
      this.#tell(`${message.topic} at ${seconds(message.timeNs)}: ${(error as Error).message}`);
    }
  }

  #finish(pending: Pending | undefined, sets: FrameSet[]): void {
    if (pending === undefined || pending.units.size === 0) return;
    const last = this.#last;
    if (last !== undefined && (pending.sequence <= last.sequence || pending.timeNs <= last.timeNs)) {
      this.#tell(`frame ${pending.sequence} at ${seconds(pending.timeNs)}: it comes after frame ${last.sequence}; dropped`);
      return;
    }
    this.#last = pending;
    for (const topic of this.#topics) {
      if (!pending.units.has(topic)) this.#tell(`${topic} at ${seconds(pending.timeNs)}: no message`);
    }
    sets.push(pending);
  }
}

export function seconds(timeNs: bigint): string {
  return `${(Number(timeNs) / 1e9).toFixed(3)} s`;
}
