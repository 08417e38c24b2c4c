/** Where a file's bytes come from: a web server by ranges, a local file, or memory. */

import { BlobReadable } from "@mcap/browser";
import type { IReadable } from "@mcap/core";
import { FileError } from "./limits.ts";

/** Bytes by offset. `size` may grow where `grow` is there. */
export interface Source extends IReadable {
  /** Look whether there is more by now; true if so. */
  grow?(): Promise<boolean>;
  /** What was asked of the network so far. */
  readonly traffic: { requests: number; bytes: number };
}

/** Taken with the first request: MCAP's own header, and all of a small file. */
const HEAD_BYTES = 1 << 16;
/** Taken with the second request: the index of a file of some hours. */
const TAIL_BYTES = 3 << 17;
/** Blocks that are kept of what was fetched. */
const KEPT_BYTES = 1 << 26;
/** Where a server has no ranges, the whole file is taken, up to this size. */
const MOST_WHOLE_BYTES = 1 << 30;

/** A range is asked for again where the connection breaks, after so many ms. */
const AGAIN_MS = [200, 1000];

const OK = 200;
const PARTIAL = 206;
const NOT_SATISFIABLE = 416;

/** A server that does not answer, or an answer that breaks off: later it may be otherwise. */
export class ConnectionLost extends FileError {}

export class BytesSource implements Source {
  readonly traffic = { requests: 0, bytes: 0 };
  readonly #bytes: Uint8Array;

  constructor(bytes: Uint8Array) {
    this.#bytes = bytes;
  }

  async size(): Promise<bigint> {
    return BigInt(this.#bytes.length);
  }

  async read(offset: bigint, size: bigint): Promise<Uint8Array> {
    return this.#bytes.subarray(Number(offset), Number(offset + size));
  }
}

export class BlobSource extends BlobReadable implements Source {
  readonly traffic = { requests: 0, bytes: 0 };
}

interface Block {
  readonly start: number;
  readonly bytes: Uint8Array;
}

/** A file on a web server. The head is taken first, the tail with it where the file is larger. */
export class HttpSource implements Source {
  readonly traffic = { requests: 0, bytes: 0 };
  readonly #url: string;
  readonly #fetch: typeof fetch;
  #size = 0;
  #blocks: Block[] = [];
  #whole = false;

  private constructor(url: string, fetcher: typeof fetch) {
    this.#url = url;
    this.#fetch = fetcher;
  }

  /** Ask for the file's start, which says how long it is. Throws FileError. */
  static async open(url: string, fetcher: typeof fetch = (...call) => fetch(...call)): Promise<HttpSource> {
    const source = new HttpSource(url, fetcher);
    await source.#range(0, HEAD_BYTES);
    return source;
  }

  async size(): Promise<bigint> {
    return BigInt(this.#size);
  }

  async read(offset: bigint, size: bigint): Promise<Uint8Array> {
    const start = Number(offset);
    const end = Number(offset + size);
    if (end > this.#size) throw new FileError(`a file of ${this.#size} bytes`, `at least ${end}`);
    const found = this.#kept(start, end);
    if (found !== undefined) return found;
    // The first bytes that are asked for at the end are the footer's: the index lies before it.
    const from = end === this.#size ? Math.max(Math.min(start, end - TAIL_BYTES), 0) : start;
    await this.#range(from, end);
    const bytes = this.#kept(start, end);
    if (bytes === undefined) throw new FileError("an answer that is too short", "the range that was asked for");
    return bytes;
  }

  async grow(): Promise<boolean> {
    if (this.#whole) return false;
    const before = this.#size;
    await this.#range(before, before + HEAD_BYTES);
    return this.#size > before;
  }

  #kept(start: number, end: number): Uint8Array | undefined {
    const block = this.#blocks.find((one) => one.start <= start && one.start + one.bytes.length >= end);
    return block?.bytes.subarray(start - block.start, end - block.start);
  }

  async #range(start: number, end: number): Promise<void> {
    for (const wait of AGAIN_MS) {
      try {
        return await this.#ask(start, end);
      } catch (error) {
        if (!(error instanceof ConnectionLost)) throw error;
        await new Promise((resolve) => setTimeout(resolve, wait));
      }
    }
    return this.#ask(start, end);
  }

  async #ask(start: number, end: number): Promise<void> {
    this.traffic.requests++;
    let answer: Response;
    try {
      answer = await this.#fetch(this.#url, { headers: { Range: `bytes=${start}-${end - 1}` } });
    } catch {
      throw new ConnectionLost(`no answer for ${this.#url}`, "a server that can be reached and allows this page");
    }
    if (answer.status === NOT_SATISFIABLE) return;
    if (answer.status !== OK && answer.status !== PARTIAL) {
      throw new FileError(`no file at ${this.#url} (its server answers ${answer.status})`, "an .mcap file");
    }
    if (answer.status === OK) return this.#takeWhole(answer);
    const total = /\/(\d+)$/.exec(answer.headers.get("Content-Range") ?? "")?.[1];
    if (total === undefined) throw new FileError("a range without the file's size", "Content-Range: bytes a-b/size");
    this.#size = Number(total);
    this.#keep({ start, bytes: await this.#body(answer, end - start) });
  }

  async #takeWhole(answer: Response): Promise<void> {
    const bytes = await this.#body(answer, MOST_WHOLE_BYTES);
    this.#whole = true;
    this.#size = bytes.length;
    this.#blocks = [{ start: 0, bytes }];
  }

  /** An answer's content. What is longer than it may be is refused before memory is taken for it, whatever was announced. */
  async #body(answer: Response, most: number): Promise<Uint8Array> {
    const parts: Uint8Array[] = [];
    let size = Number(answer.headers.get("Content-Length") ?? 0);
    if (size <= most) size = 0;
    const reader = answer.body?.getReader();
    while (size <= most) {
      const { done, value } = (await reader?.read().catch(() => this.#brokenOff(size))) ?? { done: true, value: undefined };
      if (done || value === undefined) break;
      size += value.length;
      parts.push(value);
    }
    if (size > most) {
      void reader?.cancel();
      throw new FileError(`an answer of ${size} bytes or more from ${this.#url}`, `${most} at most: a server that serves ranges of bytes`);
    }
    this.traffic.bytes += size;
    const bytes = new Uint8Array(size);
    let at = 0;
    for (const part of parts) {
      bytes.set(part, at);
      at += part.length;
    }
    return bytes;
  }

  #brokenOff(size: number): never {
    throw new ConnectionLost(`an answer from ${this.#url} that breaks off after ${size} bytes`, "the range that was asked for");
  }

  #keep(block: Block): void {
    this.#blocks.push(block);
    let total = this.#blocks.reduce((sum, one) => sum + one.bytes.length, 0);
    while (total > KEPT_BYTES && this.#blocks.length > 1) total -= this.#blocks.shift()!.bytes.length;
  }
}
