/** order_hint of AV1 frames (AV1, 5.9.2), which FORMAT.md has count up by one. */

import { FileError } from "../container/limits.ts";
import { BitReader } from "./bits.ts";
import type { PictureOrder } from "./picture_order.ts";

const [SEQUENCE_HEADER, FRAME_HEADER, FRAME] = [1, 3, 6];
const [KEY_FRAME, SWITCH_FRAME] = [0, 3];
/** seq_force_screen_content_tools, seq_force_integer_mv: each frame says. */
const SELECTED = 2;
/** More than enough of a frame for its order hint. */
const HEAD_BYTES = 64;

/** What frame headers up to their order hint need; bits of fields are 0 where they are not sent. */
interface Sequence {
  readonly timeBits: number;
  readonly idBits: number;
  readonly screenContent: number;
  readonly integerMotion: number;
  readonly orderBits: number;
}

export class Av1Order implements PictureOrder {
  #sequence: Sequence | undefined;
  #last: number | undefined;

  follows(data: Uint8Array, isKey: boolean): boolean {
    for (const [kind, content] of obus(data)) {
      if (kind === SEQUENCE_HEADER) this.#sequence = parseSequence(new BitReader(content));
      if ((kind !== FRAME_HEADER && kind !== FRAME) || this.#sequence === undefined) continue;
      const bits = new BitReader(content.subarray(0, HEAD_BYTES));
      if (bits.flag()) continue; // it shows an earlier frame
      const order = orderHint(this.#sequence, bits);
      const { orderBits } = this.#sequence;
      if (!isKey && orderBits > 0 && this.#last !== undefined && order !== (this.#last + 1) % 2 ** orderBits) return false;
      this.#last = order;
    }
    return true;
  }
}

/** obu_type and payload of each open bitstream unit (5.3). */
function* obus(data: Uint8Array): Generator<[number, Uint8Array]> {
  let at = 0;
  while (at < data.length) {
    const head = data[at];
    if ((head & 0x80) !== 0 || (head & 2) === 0) throw new FileError("a unit without a size", "AV1 units");
    at += (head & 4) !== 0 ? 2 : 1;
    let size = 0;
    for (let shift = 0; ; shift += 7) {
      if (at >= data.length || shift > 28) throw new FileError("a unit that ends too early", "AV1 units");
      size += (data[at] & 0x7f) * 2 ** shift;
      if ((data[at++] & 0x80) === 0) break;
    }
    if (at + size > data.length) throw new FileError("a unit that ends too early", "AV1 units");
    yield [(head >> 3) & 15, data.subarray(at, at + size)];
    at += size;
  }
}

/** A frame header behind show_existing_frame, up to its order hint. */
function orderHint(sequence: Sequence, bits: BitReader): number {
  const kind = bits.u(2);
  const isShown = bits.flag();
  if (isShown) bits.u(sequence.timeBits);
  else bits.flag();
  if (!(kind === SWITCH_FRAME || (kind === KEY_FRAME && isShown))) bits.flag();
  bits.flag();
  const screen = sequence.screenContent === SELECTED ? bits.u(1) : sequence.screenContent;
  if (screen !== 0 && sequence.integerMotion === SELECTED) bits.flag();
  bits.u(sequence.idBits);
  if (kind !== SWITCH_FRAME) bits.flag();
  return bits.u(sequence.orderBits);
}

/** sequence_header_obu (5.5.1), up to the order hint's bits. */
function parseSequence(bits: BitReader): Sequence {
  bits.u(3);
  bits.flag();
  if (bits.flag()) throw new FileError("a sequence of one still picture", "a video");
  const timeBits = timingAndPoints(bits);
  const [across, down] = [bits.u(4) + 1, bits.u(4) + 1];
  bits.u(across + down);
  const idBits = bits.flag() ? bits.u(4) + 2 + bits.u(3) + 1 : 0;
  bits.u(7); // superblocks, intra and inter tools
  const hasOrder = bits.flag();
  if (hasOrder) bits.u(2);
  const screenContent = bits.flag() ? SELECTED : bits.u(1);
  const integerMotion = screenContent !== 0 && !bits.flag() ? bits.u(1) : SELECTED;
  return { timeBits, idBits, screenContent, integerMotion, orderBits: hasOrder ? bits.u(3) + 1 : 0 };
}

/** Timing and operating points; returns the bits of frame_presentation_time. */
function timingAndPoints(bits: BitReader): number {
  let [isEqual, hasModel, delayBits, timeBits] = [false, false, 0, 0];
  if (bits.flag()) {
    bits.u(64);
    isEqual = bits.flag();
    if (isEqual) bits.ue();
    hasModel = bits.flag();
    if (hasModel) {
      delayBits = bits.u(5) + 1;
      bits.u(37);
      timeBits = bits.u(5) + 1;
    }
  }
  const hasDisplayDelay = bits.flag();
  for (let points = bits.u(5) + 1; points > 0; points--) {
    bits.u(12);
    if (bits.u(5) > 7) bits.flag();
    if (hasModel && bits.flag()) bits.u(2 * delayBits + 1);
    if (hasDisplayDelay && bits.flag()) bits.u(4);
  }
  return hasModel && !isEqual ? timeBits : 0;
}
