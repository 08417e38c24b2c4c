/** One track through one `VideoDecoder`: any frame of it, starting from its keyframe. */

import type { Codec } from "../container/header.ts";
import { codecString } from "./codec_string.ts";
import { pictureOrder, type PictureOrder } from "./picture_order.ts";
import { takePlanes, type Planes } from "./planes.ts";

/** A coded picture of a track; undefined where it is missing. */
export interface Unit {
  readonly frame: number;
  readonly isKey: boolean;
  /** Number of its frame set in the encoder's input. */
  readonly sequence: number;
  readonly data: Uint8Array | undefined;
}

/** Coded pictures that a decoder may have before it is waited for. */
const QUEUED = 6;
/** A decoder that says nothing for so long has given up: hardware out of sessions fails silently. */
const SILENT_MS = 4000;

/** The browser cannot decode this codec at all. */
export class NoDecoder extends Error {
  override readonly name = "NoDecoder";
}

export class TrackDecoder {
  readonly #codec: Codec;
  readonly #deliver: (frame: number, planes: Planes) => void;
  #decoder: VideoDecoder | undefined;
  #config: VideoDecoderConfig | undefined;
  #software = false;
  #failure: Error | undefined;
  #next = -1;
  /** What is waited for has been put in, and nothing has been heard of the decoder since. */
  #isFed = false;
  readonly #outputs = new Set<number>();
  #wake: () => void = () => {};
  readonly #order: PictureOrder;

  /** `deliver` gets every picture that comes out, by its frame number. */
  constructor(codec: Codec, deliver: (frame: number, planes: Planes) => void) {
    this.#codec = codec;
    this.#order = pictureOrder(codec);
    this.#deliver = deliver;
  }

  /** The frame after the last one that was put in; -1 where only a keyframe can follow. */
  get next(): number {
    return this.#next;
  }

  /**
   * Put units in, in order, and wait for the picture of one of them.
   *
   * Resolves to false where it cannot be decoded: a unit of its group of pictures is missing or damaged.
   */
  async decode(units: readonly Unit[], frame: number): Promise<boolean> {
    if (await this.#attempt(units, frame)) return true;
    const isSilent = this.#isFed && this.#failure === undefined;
    if (!isSilent || this.#software) return false;
    this.#software = true; // once more without hardware, from the keyframe on when it comes again
    this.reset();
    return units[0].isKey && this.#attempt(units, frame);
  }

  /** Forget everything; the next unit must be a keyframe. */
  reset(): void {
    if (this.#decoder !== undefined && this.#decoder.state !== "closed") this.#decoder.close();
    this.#decoder = undefined;
    this.#next = -1;
    this.#outputs.clear();
  }

  close(): void {
    this.reset();
    this.#wake();
  }

  async #attempt(units: readonly Unit[], frame: number): Promise<boolean> {
    this.#failure = undefined;
    this.#isFed = false;
    for (const unit of units) {
      if (unit.isKey && unit.data !== undefined && this.#next !== unit.frame) await this.#start(unit.data);
      const isWhole = this.#follows(unit);
      if (!isWhole && unit.frame > frame) break; // what is waited for comes before it
      if (!isWhole || this.#decoder?.state !== "configured") this.reset();
      if (this.#next < 0 && !(unit.isKey && unit.data !== undefined && this.#decoder !== undefined)) continue;
      await this.#room();
      if (this.#decoder?.state !== "configured") return false;
      this.#decoder.decode(
        new EncodedVideoChunk({ type: unit.isKey ? "key" : "delta", timestamp: unit.frame, data: unit.data! }),
      );
      this.#isFed ||= unit.frame === frame;
      this.#next = unit.frame + 1;
    }
    return this.#next > frame && (await this.#output(frame));
  }

  /** Whether it is there, and so is all that it builds on. */
  #follows({ data, isKey, sequence }: Unit): boolean {
    try {
      return data !== undefined && this.#order.follows(data, isKey, sequence);
    } catch {
      return false;
    }
  }

  async #start(key: Uint8Array): Promise<void> {
    this.reset();
    const codec = codecString(this.#codec, key);
    if (codec === undefined) return;
    if (this.#config?.codec !== codec) this.#config = await this.#supported(codec);
    const config = this.#software ? { ...this.#config, hardwareAcceleration: "prefer-software" as const } : this.#config;
    const decoder = new VideoDecoder({
      output: (frame) => this.#take(frame),
      error: (error) => {
        if (this.#decoder !== decoder) return;
        this.#failure = error;
        this.#wake();
      },
    });
    decoder.configure(config);
    this.#decoder = decoder;
    this.#next = 0;
  }

  async #supported(codec: string): Promise<VideoDecoderConfig> {
    const config: VideoDecoderConfig = { codec, optimizeForLatency: true };
    if (!("VideoDecoder" in globalThis)) throw new NoDecoder("this browser has no WebCodecs");
    const { supported } = await VideoDecoder.isConfigSupported(config).catch(() => ({ supported: false }));
    if (!supported) throw new NoDecoder(`this browser does not decode ${this.#codec} (${codec})`);
    return config;
  }

  #take(frame: VideoFrame): void {
    const number = frame.timestamp;
    takePlanes(frame).then(
      (planes) => {
        this.#outputs.add(number);
        this.#deliver(number, planes);
      },
      (error: Error) => {
        this.#failure = error;
      },
    ).finally(() => this.#wake());
  }

  /** Wait until the decoder has room for more. */
  async #room(): Promise<void> {
    const isFull = () => this.#decoder?.state === "configured" && this.#decoder.decodeQueueSize > QUEUED;
    while (isFull() && this.#failure === undefined) await this.#news(50);
  }

  async #output(frame: number): Promise<boolean> {
    const isThere = () => this.#outputs.has(frame);
    for (let waited = 0; waited < SILENT_MS && !isThere() && this.#failure === undefined; waited += 50) {
      await this.#news(50);
      // Some decoders hold pictures back until they are told that no more come.
      if (waited === 200 && !isThere() && this.#decoder?.state === "configured" && this.#decoder.decodeQueueSize === 0) {
        const answer = this.#decoder.flush().then(() => true, () => true);
        this.#next = -1;
        // One that has given up never answers; one that does will not do better in software.
        if (!(await Promise.race([answer, silence()]))) break;
        this.#isFed = false;
      }
    }
    if (this.#failure !== undefined) this.reset();
    return isThere();
  }

  #news(ms: number): Promise<void> {
    return new Promise((resolve) => {
      const timer = setTimeout(resolve, ms);
      this.#wake = () => {
        clearTimeout(timer);
        resolve();
      };
    });
  }
}

function silence(): Promise<false> {
  return new Promise((resolve) => setTimeout(() => resolve(false), SILENT_MS));
}
