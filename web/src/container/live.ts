/** What an encoder sends while it encodes: Foxglove's WebSocket protocol (`mvcodec encode --live-view`). */

import { Assembler, type Tell } from "./assembly.ts";
import type { Header } from "./header.ts";
import { FileError } from "./limits.ts";
import { HEADER_TOPIC, tracksOf, type FrameSet } from "./messages.ts";
import type { Recording, Span } from "./recording.ts";
import type { TopicMessage } from "./records.ts";

const PROTOCOLS = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
const MESSAGE_DATA = 1;
/** Opcode, subscription, time; then the message. */
const DATA_HEAD = 13;
/** Frame sets that can be gone back to, in bytes of what is coded. */
const KEPT_BYTES = 1 << 27;
const STREAM_TOPIC = /^\/(mvcodec\/header|camera\/r\d{2,}_c\d{2,}\/(video|disparity))$/;

export function isLiveAddress(address: string): boolean {
  return /^wss?:/i.test(address);
}

export class LiveRecording implements Recording {
  readonly spans: Span[] = [];
  growing = true;
  readonly #socket: WebSocket;
  readonly #assembler: Assembler;
  readonly #tell: Tell;
  readonly #sets = new Map<Span, FrameSet>();
  /** Subscriptions have the numbers of their channels. */
  readonly #topics = new Map<number, string>();
  #pending: TopicMessage[] = [];
  /** Frame sets carry no number here: they are counted by their times. */
  #sequence = 0;
  #bytes = 0;
  #onNews: () => void = () => {};
  #failure: Error | undefined;

  private constructor(address: string, tell: Tell) {
    this.#tell = tell;
    this.#assembler = new Assembler(tell);
    this.#socket = new WebSocket(address, PROTOCOLS);
    this.#socket.binaryType = "arraybuffer";
    this.#socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      try {
        if (typeof data === "string") this.#said(data);
        else this.#take(new Uint8Array(data));
      } catch (error) {
        this.#tell((error as Error).message);
      }
    };
    this.#socket.onclose = ({ code }) => {
      this.#failure ??= new FileError(`a live view that ended (${code})`, "mvcodec encode --live-view");
      this.growing = false;
      this.#onNews();
    };
  }

  /** Wait for the next keyframe; `onGrowth` is called with each frame set from then on. Throws FileError. */
  static async open(address: string, tell: Tell, onGrowth: () => void): Promise<LiveRecording> {
    const recording = new LiveRecording(address, tell);
    while (recording.spans.length === 0) {
      if (recording.#failure !== undefined) throw recording.#failure;
      await new Promise<void>((resolve) => (recording.#onNews = resolve));
    }
    recording.#onNews = onGrowth;
    return recording;
  }

  get header(): Header {
    return this.#assembler.header!;
  }

  async load(span: Span): Promise<readonly FrameSet[]> {
    const set = this.#sets.get(span);
    return set === undefined ? [] : [set];
  }

  close(): void {
    this.growing = false;
    this.#onNews = () => {};
    this.#socket.close();
  }

  #said(text: string): void {
    const said = JSON.parse(text) as { op?: unknown; channels?: { id: number; topic: string }[] };
    if (said.op !== "advertise" || !Array.isArray(said.channels)) return;
    const wanted = said.channels.filter(({ topic }) => STREAM_TOPIC.test(topic));
    for (const { id, topic } of wanted) this.#topics.set(id, topic);
    const subscriptions = wanted.map(({ id }) => ({ id, channelId: id }));
    this.#socket.send(JSON.stringify({ op: "subscribe", subscriptions }));
  }

  #take(bytes: Uint8Array): void {
    if (bytes[0] !== MESSAGE_DATA || bytes.length < DATA_HEAD) return;
    const view = new DataView(bytes.buffer);
    const topic = this.#topics.get(view.getUint32(1, true));
    if (topic === undefined) return;
    const timeNs = view.getBigUint64(5, true);
    if (this.#pending.length > 0 && this.#pending[0].timeNs !== timeNs) this.#finish();
    this.#pending.push({ topic, sequence: this.#sequence, timeNs, data: bytes.subarray(DATA_HEAD) });
    if (this.#isWhole()) this.#finish();
  }

  /** Every stream of the header has its message. */
  #isWhole(): boolean {
    const { header } = this.#assembler;
    const streams = this.#pending.filter(({ topic }) => topic !== HEADER_TOPIC).length;
    return header !== undefined && streams >= tracksOf(header).length;
  }

  #finish(): void {
    const messages = this.#pending;
    this.#pending = [];
    this.#sequence++;
    for (const set of this.#assembler.assemble(messages)) {
      if (this.spans.length > 0 || set.isKey) this.#append(set);
    }
  }

  #append(set: FrameSet): void {
    const span = { first: this.spans.length, count: 1, startNs: set.timeNs, endNs: set.timeNs, isKey: set.isKey };
    this.spans.push(span);
    this.#sets.set(span, set);
    this.#bytes += bytesOf(set);
    for (const [old, gone] of this.#sets) {
      if (this.#bytes <= KEPT_BYTES) break;
      this.#sets.delete(old);
      this.#bytes -= bytesOf(gone);
    }
    this.#onNews();
  }
}

function bytesOf(set: FrameSet): number {
  return [...set.units.values()].reduce((sum, unit) => sum + unit.length, 0);
}
