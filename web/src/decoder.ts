/** The decoder without a player: what is in a file, frame by frame and plane by plane. */

import type { Header } from "./container/header.ts";
import { tracksOf, type Track } from "./container/messages.ts";
import { openRecording } from "./container/open.ts";
import { frameCount, spanAt, type Recording } from "./container/recording.ts";
import { BlobSource, HttpSource } from "./container/sources.ts";
import { FrameStore } from "./decode/frame_store.ts";
import type { Planes } from "./decode/planes.ts";

export class FileDecoder {
  /** What was wrong with the file so far, for people. */
  readonly troubles: string[];
  readonly #recording: Recording;
  readonly #store: FrameStore;

  private constructor(recording: Recording, troubles: string[]) {
    this.#recording = recording;
    this.troubles = troubles;
    this.#store = new FrameStore(recording, (text) => troubles.push(text));
  }

  /** Open a file by its address, or one that the page has. Throws Error, with what was found and expected. */
  static async open(from: string | Blob): Promise<FileDecoder> {
    const source = typeof from === "string" ? await HttpSource.open(from) : new BlobSource(from);
    const troubles: string[] = [];
    const tell = (text: string) => void troubles.push(text);
    return new FileDecoder(await openRecording(source, { fromSeconds: 0, tell }), troubles);
  }

  get header(): Header {
    return this.#recording.header;
  }

  get tracks(): Track[] {
    return tracksOf(this.header);
  }

  get count(): number {
    return frameCount(this.#recording);
  }

  /** Number in the encoder's input and time of a frame; undefined where it is damaged. */
  async frame(number: number): Promise<{ index: number; timeNs: bigint } | undefined> {
    const span = spanAt(this.#recording.spans, number);
    const set = (await this.#recording.load(span))[number - span.first];
    return set && { index: set.sequence, timeNs: set.timeNs };
  }

  /** A track's picture or map as decoded, with its even size; undefined where it is missing. Throws NoDecoder. */
  planes(topic: string, number: number): Promise<Planes | undefined> {
    return this.#store.planes(topic, number);
  }

  close(): void {
    this.#store.close();
    this.#recording.close();
  }
}
