/** The WebSocket of a server that sends pictures: opens again by itself, and takes a picture's message apart. */

import type { ServerWork } from "./statistics.ts";
import type { Legend } from "./legend.ts";
import { TEXTS } from "./texts.ts";

/** What the server says of its file first. */
export interface Hello {
  readonly type: "hello";
  readonly title: string;
  readonly rows: number;
  readonly cols: number;
  readonly real_rows: readonly number[];
  readonly real_cols: readonly number[];
  readonly enhanced: readonly (readonly [number, number])[];
  readonly width: number;
  readonly height: number;
  readonly fps: number;
  readonly codec: string;
  readonly rho: number;
  readonly range_px: readonly [number, number];
  readonly infinity_px_per_step: number;
  /** Of each frame, from the first one. */
  readonly times_s: readonly number[];
  readonly looks: readonly string[];
  readonly synthesizer: string;
  /** What is wrong with the file's end. */
  readonly cut_off: string | null;
}

/** What it says of a picture. */
export interface Facts extends ServerWork {
  readonly picture: number;
  readonly frame: number;
  readonly row: number;
  readonly col: number;
  readonly look: string;
  readonly eyes: string;
  readonly eye_steps: number;
  readonly focus_px: number | null;
  readonly dolly: number;
  readonly wipe: number;
  readonly legend: (Partial<NonNullable<Legend["scale"]>> & { readonly text: string; readonly items?: Legend["classes"] }) | null;
  readonly quality: { readonly psnr_db: number | null; readonly ssim: number | null; readonly reason: string | null } | null;
  readonly damage: { readonly first: number; readonly time_s: number; readonly goes_on_s: number | null; readonly message: string } | null;
}

type Said =
  | Hello
  | { readonly type: "state"; readonly playing: boolean }
  | { readonly type: "trouble"; readonly message: string }
  | { readonly type: "place"; readonly disparity_px: number | null; readonly depth_m: number | null };

export interface ServerEvents {
  onSaid(message: Said): void;
  onPicture(facts: Facts, jpeg: Blob): void;
  /** It is gone, and is tried again. */
  onAway(reason: string): void;
}

const FIRST_WAIT_MS = 400;
const LONGEST_WAIT_MS = 5000;
const BUSY = 1013;
const REFUSED = 1008;

export class ServerConnection {
  readonly #address: string;
  readonly #events: ServerEvents;
  #socket: WebSocket | undefined;
  #waitMs = FIRST_WAIT_MS;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(address: string, events: ServerEvents) {
    this.#address = address;
    this.#events = events;
    this.#open();
  }

  /** Messages are small and rare; one that cannot go now is out of date when it could. */
  send(type: string, fields: Record<string, unknown> = {}): void {
    if (this.#socket?.readyState === WebSocket.OPEN) this.#socket.send(JSON.stringify({ type, ...fields }));
  }

  close(): void {
    clearTimeout(this.#timer);
    const socket = this.#socket;
    this.#socket = undefined;
    socket?.close();
  }

  #open(): void {
    const socket = new WebSocket(this.#address);
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({ data }) => this.#receive(data as string | ArrayBuffer);
    socket.onclose = (event) => (this.#socket === socket ? this.#closed(event) : undefined);
    this.#socket = socket;
  }

  #receive(data: string | ArrayBuffer): void {
    if (this.#socket === undefined) return;
    if (typeof data === "string") {
      const message = JSON.parse(data) as Said;
      if (message.type === "hello") this.#waitMs = FIRST_WAIT_MS;
      this.#events.onSaid(message);
      return;
    }
    const length = new DataView(data).getUint32(0);
    const facts = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length))) as Facts;
    this.#events.onPicture(facts, new Blob([new Uint8Array(data, 4 + length)], { type: "image/jpeg" }));
  }

  #closed({ code, reason }: CloseEvent): void {
    this.#events.onAway(code === BUSY ? reason : code === REFUSED ? TEXTS.serverRefuses(reason) : TEXTS.serverGone);
    this.#timer = setTimeout(() => this.#open(), this.#waitMs);
    this.#waitMs = Math.min(2 * this.#waitMs, LONGEST_WAIT_MS);
  }
}
