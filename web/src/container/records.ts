/** MCAP records -> messages with their topics, whatever was damaged before them. */

import { McapRecordBuilder, McapStreamReader, type TypedMcapRecord, type TypedMcapRecords } from "@mcap/core";
import { decompress as unzstd } from "fzstd";
import { checkLimit, FileError } from "./limits.ts";

/** A message, and the topic that its channel stands for. */
export interface TopicMessage {
  readonly topic: string;
  readonly sequence: number;
  readonly timeNs: bigint;
  readonly data: Uint8Array;
}

/** Opcode and length in front of each record. */
export const RECORD_HEAD = 9;

/** Unpack a chunk. Throws FileError where it would take too much or is damaged. */
export function unpack(packed: Uint8Array, size: bigint): Uint8Array {
  checkLimit("chunkBytes", size, "bytes of a chunk, unpacked");
  const room = new Uint8Array(Number(size));
  const bytes = unzstd(packed, room);
  if (bytes.length !== room.length) throw new FileError(`a chunk of ${bytes.length} bytes`, `${room.length}`);
  return bytes;
}

/** Takes records one by one. A damaged one throws, and the next one is read as if it had not been there. */
export class RecordReader {
  #parser = newParser();
  readonly #topics = new Map<number, string>();
  readonly #declared = new Map<string, Uint8Array>();

  get topics(): ReadonlySet<string> {
    return new Set(this.#topics.values());
  }

  /** Take over what a summary declares. */
  declare(channels: Iterable<TypedMcapRecords["Channel"]>): void {
    for (const channel of channels) {
      const builder = new McapRecordBuilder();
      builder.writeChannel(channel);
      this.push(builder.buffer.slice());
    }
  }

  /** A whole record, or the unpacked records of a chunk -> messages. Throws Error where it is damaged. */
  push(bytes: Uint8Array): TopicMessage[] {
    const messages: TopicMessage[] = [];
    try {
      this.#parser.append(bytes);
      for (let record = this.#parser.nextRecord(); record; record = this.#parser.nextRecord()) {
        const message = this.#take(record);
        if (message !== undefined) messages.push(message);
      }
      if (this.#parser.bytesRemaining() > 0) throw new FileError("bytes behind the last record", "whole records");
    } catch (error) {
      this.#parser = newParser();
      for (const declared of this.#declared.values()) {
        this.#parser.append(declared);
        this.#parser.nextRecord();
      }
      throw error;
    }
    return messages;
  }

  /** What of a chunk's records is there, up to where they break off. */
  pushPart(bytes: Uint8Array): TopicMessage[] {
    const whole = wholeRecords(bytes);
    return whole > 0 ? this.push(bytes.subarray(0, whole)) : [];
  }

  #take(record: TypedMcapRecord): TopicMessage | undefined {
    if (record.type === "Channel") {
      this.#topics.set(record.id, record.topic);
      const builder = new McapRecordBuilder();
      builder.writeChannel(record);
      this.#declared.set(`${record.id}`, builder.buffer.slice());
    }
    if (record.type !== "Message") return undefined;
    const topic = this.#topics.get(record.channelId)!;
    return { topic, sequence: record.sequence, timeNs: record.logTime, data: record.data };
  }
}

/** How many bytes at the start are whole records. */
function wholeRecords(bytes: Uint8Array): number {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let at = 0;
  while (at + RECORD_HEAD <= bytes.length) {
    const end = at + RECORD_HEAD + Number(view.getBigUint64(at + 1, true));
    if (end > bytes.length) break;
    at = end;
  }
  return at;
}

function newParser(): McapStreamReader {
  return new McapStreamReader({ noMagicPrefix: true, decompressHandlers: { zstd: unpack } });
}
