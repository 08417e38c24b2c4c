/** An MCAP file without an index, read from front to back: it grows, was cut, or its index is damaged. */

import { hasMcapPrefix, MCAP_MAGIC, Opcode } from "@mcap/core";
import { Decompress } from "fzstd";
import { Assembler, type Tell } from "./assembly.ts";
import type { Header } from "./header.ts";
import { checkLimit, FileError, LIMITS } from "./limits.ts";
import type { FrameSet } from "./messages.ts";
import type { Recording, Span } from "./recording.ts";
import { RECORD_HEAD, RecordReader, type TopicMessage } from "./records.ts";
import type { Source } from "./sources.ts";

/** How much is read at once. */
const BLOCK_BYTES = 1n << 20n;
/** A file that another program writes is looked at so often. */
const POLL_MS = 500;
/** After so many looks that find nothing new it is taken to be complete: a minute. */
const MOST_QUIET = 120;
/** Fields of a chunk in front of the name of its compression. */
const CHUNK_HEAD = 28;

export class StreamedRecording implements Recording {
  readonly spans: Span[] = [];
  growing = false;
  readonly #sets = new Map<Span, readonly FrameSet[]>();
  readonly #records = new RecordReader();
  readonly #assembler: Assembler;
  readonly #source: Source;
  readonly #tell: Tell;
  #at = BigInt(MCAP_MAGIC.length);
  #timer: ReturnType<typeof setTimeout> | undefined;
  #isEnd = false;
  /** Looks in a row that found nothing new. */
  #quiet = 0;
  #isBroken = false;

  private constructor(source: Source, tell: Tell) {
    this.#source = source;
    this.#tell = tell;
    this.#assembler = new Assembler(tell);
  }

  /** Read what is there. Where the source can grow, go on reading as it does. Throws FileError. */
  static async open(source: Source, tell: Tell, onGrowth?: () => void): Promise<StreamedRecording> {
    const recording = new StreamedRecording(source, tell);
    const start = await source.read(0n, bigMin(await source.size(), BigInt(MCAP_MAGIC.length)));
    const view = new DataView(start.buffer, start.byteOffset, start.byteLength);
    if (start.length < MCAP_MAGIC.length || !hasMcapPrefix(view)) {
      throw new FileError(start.length === 0 ? "an empty file" : "a file that is not MCAP", "a file that mvcodec encoded");
    }
    await recording.#readOn();
    recording.growing = !recording.#isEnd && source.grow !== undefined && onGrowth !== undefined;
    if (!recording.#isEnd && !recording.growing) await recording.#salvage();
    if (recording.#assembler.header === undefined || recording.spans.length === 0) {
      throw new FileError("no frame set that can be read", "a file that mvcodec encoded");
    }
    if (recording.growing && onGrowth !== undefined) recording.#follow(onGrowth);
    return recording;
  }

  get header(): Header {
    return this.#assembler.header!;
  }

  async load(span: Span): Promise<readonly FrameSet[]> {
    return this.#sets.get(span) ?? [];
  }

  close(): void {
    this.growing = false;
    clearTimeout(this.#timer);
  }

  #follow(onGrowth: () => void): void {
    this.#timer = setTimeout(async () => {
      try {
        this.#quiet++;
        if (await this.#source.grow?.()) {
          this.#quiet = 0;
          await this.#readOn();
          onGrowth();
        }
      } catch (error) {
        this.#tell((error as Error).message);
      }
      this.growing &&= !this.#isEnd && this.#quiet < MOST_QUIET;
      if (this.growing) this.#follow(onGrowth);
      else onGrowth();
    }, POLL_MS);
  }

  /** Take every whole record from where the last one ended. */
  async #readOn(): Promise<void> {
    const size = await this.#source.size();
    while (!this.#isEnd && this.#at + BigInt(RECORD_HEAD) <= size) {
      const { opcode, length } = await this.#head(size);
      if (length > BigInt(LIMITS.recordBytes)) {
        this.#tell(`at byte ${this.#at}: a record of ${length} bytes; what follows is left out`);
        this.#isEnd = true;
        return;
      }
      const whole = BigInt(RECORD_HEAD) + length;
      if (this.#at + whole > size) return;
      this.#isEnd = opcode === Opcode.DATA_END || opcode === Opcode.FOOTER;
      if (opcode === Opcode.CHUNK || opcode === Opcode.CHANNEL || opcode === Opcode.MESSAGE) {
        const bytes = await this.#source.read(this.#at, whole);
        this.#take(() => this.#records.push(bytes));
      }
      this.#at += whole;
    }
  }

  async #head(size: bigint): Promise<{ opcode: number; length: bigint }> {
    await this.#source.read(this.#at, bigMin(BLOCK_BYTES, size - this.#at)); // a block at once, then from memory
    const head = await this.#source.read(this.#at, BigInt(RECORD_HEAD));
    const view = new DataView(head.buffer, head.byteOffset, head.byteLength);
    return { opcode: view.getUint8(0), length: view.getBigUint64(1, true) };
  }

  /** Frame sets out of a record. After damage they are left out up to the next keyframe. */
  #take(read: () => TopicMessage[]): void {
    let sets: FrameSet[] = [];
    try {
      sets = this.#assembler.assemble(read());
    } catch (error) {
      this.#tell(`at byte ${this.#at}: damage (${(error as Error).message})`);
      this.#isBroken = true;
    }
    const start = this.#isBroken ? sets.findIndex((set) => set.isKey) : 0;
    if (start < 0 || sets.length === 0) return;
    this.#isBroken = false;
    this.#append(sets.slice(start));
  }

  #append(sets: readonly FrameSet[]): void {
    const last = this.spans.at(-1);
    const span = {
      first: last === undefined ? 0 : last.first + last.count,
      count: sets.length,
      startNs: sets[0].timeNs,
      endNs: sets[sets.length - 1].timeNs,
      isKey: sets[0].isKey,
    };
    this.spans.push(span);
    this.#sets.set(span, sets);
  }

  /** The whole frame sets in a chunk that breaks off. Its checksum is lost; decoders find damage. */
  async #salvage(): Promise<void> {
    const size = await this.#source.size();
    if (this.#at + BigInt(RECORD_HEAD + CHUNK_HEAD + 4) > size) return;
    const rest = await this.#source.read(this.#at, size - this.#at);
    const records = unpackPart(rest);
    if (records.length > 0) this.#take(() => this.#records.pushPart(records));
    this.#tell("the file breaks off; what comes before is used");
  }
}

/** What is there of the records of a chunk that breaks off. */
function unpackPart(bytes: Uint8Array): Uint8Array {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (view.getUint8(0) !== Opcode.CHUNK) return new Uint8Array();
  const nameLength = view.getUint32(RECORD_HEAD + CHUNK_HEAD, true);
  const start = RECORD_HEAD + CHUNK_HEAD + 4 + nameLength + 8;
  if (start >= bytes.length) return new Uint8Array();
  if (nameLength === 0) return bytes.subarray(start);
  const parts: Uint8Array[] = [];
  let total = 0;
  try {
    const unzstd = new Decompress((part) => {
      total += part.length;
      checkLimit("chunkBytes", total, "bytes of a chunk, unpacked");
      parts.push(part.slice());
    });
    unzstd.push(bytes.subarray(start), false);
  } catch {
    // What came before the damage is there.
  }
  const whole = new Uint8Array(total);
  let at = 0;
  for (const part of parts) {
    whole.set(part, at);
    at += part.length;
  }
  return whole;
}

function bigMin(a: bigint, b: bigint): bigint {
  return a < b ? a : b;
}
