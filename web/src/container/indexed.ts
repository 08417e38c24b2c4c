/** A complete MCAP file, read by its index: only what is asked for. */

import { McapIndexedReader, type TypedMcapRecords } from "@mcap/core";
import { Assembler, type Tell } from "./assembly.ts";
import type { Header } from "./header.ts";
import { checkLimit, FileError } from "./limits.ts";
import { HEADER_TOPIC, type FrameSet } from "./messages.ts";
import type { Recording, Span } from "./recording.ts";
import { RecordReader, unpack } from "./records.ts";
import { ConnectionLost, type Source } from "./sources.ts";

type ChunkIndex = TypedMcapRecords["ChunkIndex"];

/** Magic, and the record of the footer: its start says where the index begins. */
const FOOTER_BYTES = 9n + 20n + 8n;
/** Around the entries of a message index: opcode, length, channel, bytes of entries. */
const MESSAGE_INDEX_HEAD = 15;
const MESSAGE_INDEX_ENTRY = 16;
/** The least that a message takes in a chunk. */
const MESSAGE_BYTES = 31n;
/** Frame sets that are kept for another look, in bytes of what is coded. */
const KEPT_BYTES = 1 << 26;
/** What was lost with the connection is asked for again after so long, ms. */
const LOST_MS = 1000;
const VIDEO_TOPIC = /^\/camera\/r\d{2,}_c\d{2,}\/video$/;

/** The index of a file, or undefined where it has none (it grows, or was cut). Throws where it is damaged. */
export async function readIndex(source: Source): Promise<McapIndexedReader | undefined> {
  const size = await source.size();
  if (size < FOOTER_BYTES + 8n) return undefined;
  const tail = await source.read(size - FOOTER_BYTES, FOOTER_BYTES);
  const magic = [0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a];
  if (!magic.every((byte, i) => tail[tail.length - 8 + i] === byte)) return undefined;
  const start = new DataView(tail.buffer, tail.byteOffset, tail.byteLength).getBigUint64(9, true);
  if (start === 0n) return undefined;
  if (start > size) throw new FileError("an index behind the file's end", "an MCAP file");
  checkLimit("indexBytes", size - start, "bytes of an index");
  const reader = await McapIndexedReader.Initialize({ readable: source, decompressHandlers: { zstd: unpack } });
  return reader.chunkIndexes.length > 0 ? reader : undefined;
}

export class IndexedRecording implements Recording {
  readonly growing = false;
  readonly spans: readonly Span[];
  readonly #source: Source;
  readonly #chunks: readonly ChunkIndex[];
  readonly #records = new RecordReader();
  readonly #assembler: Assembler;
  readonly #tell: Tell;
  readonly #kept = new Map<number, Promise<readonly FrameSet[]>>();
  readonly #size: bigint;
  /** The first thing that was wrong: why there is no header. */
  #failure: unknown;

  private constructor(source: Source, size: bigint, reader: McapIndexedReader, tell: Tell) {
    this.#source = source;
    this.#size = size;
    this.#tell = tell;
    this.#assembler = new Assembler(tell);
    this.#records.declare(reader.channelsById.values());
    this.#chunks = [...reader.chunkIndexes].sort((a, b) => Number(a.chunkStartOffset - b.chunkStartOffset));
    this.spans = spansOf(this.#chunks, reader);
  }

  /** Take the header from the chunk of a time, or from the first keyframe that can be read. Throws FileError. */
  static async open(source: Source, reader: McapIndexedReader, fromSeconds: number, tell: Tell): Promise<IndexedRecording> {
    const recording = new IndexedRecording(source, await source.size(), reader, tell);
    const keys = recording.spans.filter((span) => span.isKey);
    if (keys.length === 0) throw new FileError("a file without /mvcodec/header", "a file that mvcodec encoded");
    const wanted = recording.spans[0].startNs + BigInt(Math.round(fromSeconds * 1e9));
    const first = keys.findLastIndex((span) => span.startNs <= wanted);
    for (const span of [...keys.slice(Math.max(first, 0)), ...keys.slice(0, Math.max(first, 0))]) {
      await recording.load(span);
      if (recording.#assembler.header !== undefined) return recording;
    }
    throw recording.#failure ?? new FileError("no header that can be read", "a file that mvcodec encoded");
  }

  get header(): Header {
    return this.#assembler.header!;
  }

  load(span: Span): Promise<readonly FrameSet[]> {
    const place = this.spans.indexOf(span);
    let sets = this.#kept.get(place);
    this.#kept.delete(place); // to the end: the chunk that was not asked for longest goes first
    sets ??= this.#read(span, this.#chunks[place]);
    this.#kept.set(place, sets);
    this.#forget();
    return sets;
  }

  close(): void {
    this.#kept.clear();
  }

  #forget(): void {
    const places = [...this.#kept.keys()];
    let bytes = places.reduce((sum, place) => sum + Number(this.#chunks[place].uncompressedSize), 0);
    for (const place of places.slice(0, -2)) {
      if (bytes <= KEPT_BYTES) break;
      bytes -= Number(this.#chunks[place].uncompressedSize);
      this.#kept.delete(place);
    }
  }

  async #read(span: Span, chunk: ChunkIndex): Promise<readonly FrameSet[]> {
    try {
      checkLimit("recordBytes", chunk.chunkLength, "bytes of a chunk");
      if (chunk.chunkStartOffset + chunk.chunkLength > this.#size) {
        throw new FileError("a chunk behind the file's end", "an index that is true");
      }
      const bytes = await this.#source.read(chunk.chunkStartOffset, chunk.chunkLength);
      this.#assembler.restart(); // chunks are read in any order
      const sets = this.#assembler.assemble(this.#records.push(bytes));
      if (sets.length > span.count) throw new FileError(`${sets.length} frame sets`, `${span.count} by the index`);
      return sets;
    } catch (error) {
      this.#failure ??= error;
      if (error instanceof ConnectionLost) setTimeout(() => this.#kept.delete(this.spans.indexOf(span)), LOST_MS);
      const from = (Number(span.startNs) / 1e9).toFixed(3);
      this.#tell(`${from}..${(Number(span.endNs) / 1e9).toFixed(3)} s: damage (${(error as Error).message})`);
      return [];
    }
  }
}

/** How many frame sets each chunk holds stands in the index: in how long its message indexes are. */
function spansOf(chunks: readonly ChunkIndex[], reader: McapIndexedReader): Span[] {
  const topics = new Map([...reader.channelsById.values()].map((channel) => [channel.id, channel.topic]));
  const spans: Span[] = [];
  let first = 0;
  for (const chunk of chunks) {
    const ends = [...chunk.messageIndexOffsets.values(), chunk.chunkStartOffset + chunk.chunkLength + chunk.messageIndexLength];
    ends.sort((a, b) => (a < b ? -1 : 1));
    let count = 0;
    let isKey = false;
    for (const [channel, offset] of chunk.messageIndexOffsets) {
      const topic = topics.get(channel) ?? "";
      isKey ||= topic === HEADER_TOPIC;
      if (!VIDEO_TOPIC.test(topic)) continue;
      const length = Number(ends[ends.indexOf(offset) + 1] - offset);
      count = Math.max(count, Math.floor((length - MESSAGE_INDEX_HEAD) / MESSAGE_INDEX_ENTRY));
    }
    if (BigInt(count) * MESSAGE_BYTES > chunk.uncompressedSize) throw new FileError("an index of more than is there", "an index that is true");
    spans.push({ first, count, startNs: chunk.messageStartTime, endNs: chunk.messageEndTime, isKey });
    first += count;
  }
  return spans;
}
