/** Reference picture sets of HEVC pictures (ITU-T H.265, 8.3.1 and 8.3.2): what one builds on must be there. */

import { FileError } from "../container/limits.ts";
import { payload, BitReader } from "./bits.ts";
import { nalUnits } from "./h264_order.ts";
import type { PictureOrder } from "./picture_order.ts";

const [LAST_SLICE, SPS, PPS] = [31, 33, 34];
const [FIRST_IRAP, LAST_IRAP, IDR_KINDS] = [16, 23, [19, 20]];
/** Sub-layer non-reference and leading pictures: no later order count builds on theirs (8.3.1). */
const NO_ANCHOR = [0, 2, 4, 6, 7, 8, 9, 10, 12, 14];
const HEAD_BYTES = 2;
/** More than enough of a slice for the reference pictures in its header. */
const SLICE_BYTES = 512;
const MOST_SETS = 64;
const MOST_REFERENCES = 16;

/** A picture that stays: its order count from the one at hand, and whether that builds on it. */
interface Reference {
  readonly step: number;
  readonly isUsed: boolean;
}

interface Sequence {
  readonly orderBits: number;
  readonly sets: readonly (readonly Reference[])[];
  readonly hasPlanesApart: boolean;
}

interface PictureSet {
  readonly sequence: number;
  readonly hasOutputFlag: boolean;
  readonly extraBits: number;
}

export class HevcOrder implements PictureOrder {
  readonly #sequences = new Map<number, Sequence>();
  readonly #pictureSets = new Map<number, PictureSet>();
  /** Order counts of the pictures that are there. */
  #held = new Set<number>();
  /** Of the picture that the next one's order count builds on. */
  #anchor = 0;

  follows(data: Uint8Array): boolean {
    let isThere = false;
    for (const unit of nalUnits(data)) {
      const kind = (unit[0] >> 1) & 63;
      if (kind === SPS) this.#sequences.set(...parseSequence(new BitReader(payload(unit, HEAD_BYTES))));
      if (kind === PPS) this.#pictureSets.set(...parsePictureSet(new BitReader(payload(unit, HEAD_BYTES))));
      if (kind > LAST_SLICE || (unit[HEAD_BYTES] & 0x80) === 0) continue; // not the picture's first slice
      isThere = true;
      if (!this.#picture(unit, kind)) return false;
    }
    return isThere;
  }

  #picture(unit: Uint8Array, kind: number): boolean {
    const bits = new BitReader(payload(unit.subarray(0, SLICE_BYTES), HEAD_BYTES));
    bits.flag();
    if (kind >= FIRST_IRAP && kind <= LAST_IRAP) bits.flag();
    const pictureSet = this.#pictureSets.get(bits.ue());
    const sequence = pictureSet && this.#sequences.get(pictureSet.sequence);
    if (pictureSet === undefined || sequence === undefined) return false;
    if (IDR_KINDS.includes(kind)) {
      this.#held = new Set([0]);
      this.#anchor = 0;
      return true;
    }
    bits.u(pictureSet.extraBits);
    bits.ue();
    if (pictureSet.hasOutputFlag) bits.flag();
    if (sequence.hasPlanesApart) bits.u(2);
    const order = fullOrder(this.#anchor, bits.u(sequence.orderBits), 2 ** sequence.orderBits);
    const stays = stayingOf(bits, sequence);
    if (stays.some(({ step, isUsed }) => isUsed && !this.#held.has(order + step))) return false;
    if ((unit[1] & 7) === 1 && !NO_ANCHOR.includes(kind)) this.#anchor = order;
    this.#held = new Set([order, ...stays.map(({ step }) => order + step).filter((one) => this.#held.has(one))]);
    return true;
  }
}

/** PicOrderCntVal (8-1). */
function fullOrder(anchor: number, low: number, top: number): number {
  const before = ((anchor % top) + top) % top;
  const high = anchor - before;
  if (low < before && before - low >= top / 2) return high + top + low;
  if (low > before && low - before > top / 2) return high - top + low;
  return high + low;
}

/** The short-term reference picture set of a slice: its own, or one that the sequence has. */
function stayingOf(bits: BitReader, { sets }: Sequence): readonly Reference[] {
  if (!bits.flag()) return referenceSet(bits, sets.length, sets, true);
  const number = sets.length > 1 ? bits.u(Math.ceil(Math.log2(sets.length))) : 0;
  if (number >= sets.length) throw new FileError("a reference picture set that was not sent", "one that was");
  return sets[number];
}

function parsePictureSet(bits: BitReader): [number, PictureSet] {
  const [number, sequence] = [bits.ue(), bits.ue()];
  bits.flag();
  return [number, { sequence, hasOutputFlag: bits.flag(), extraBits: bits.u(3) }];
}

/** A sequence parameter set (7.3.2.2), up to its reference picture sets. */
function parseSequence(bits: BitReader): [number, Sequence] {
  bits.u(4);
  const layers = bits.u(3) + 1;
  bits.flag();
  skipProfile(bits, layers);
  const number = bits.ue();
  const hasPlanesApart = bits.ue() === 3 && bits.flag();
  bits.ue();
  bits.ue();
  if (bits.flag()) for (let side = 0; side < 4; side++) bits.ue(); // conformance window
  bits.ue();
  bits.ue();
  const orderBits = bits.ue() + 4;
  if (orderBits > 16) throw new FileError(`${orderBits} bits of picture order count`, "16 at most");
  for (let layer = bits.flag() ? layers : 1; layer > 0; layer--) for (let k = 0; k < 3; k++) bits.ue();
  for (let k = 0; k < 6; k++) bits.ue(); // sizes of blocks and depths of trees
  if (bits.flag() && bits.flag()) skipScalingLists(bits);
  bits.u(2);
  if (bits.flag()) {
    bits.u(8); // PCM
    bits.ue();
    bits.ue();
    bits.flag();
  }
  const count = bits.ue();
  if (count > MOST_SETS) throw new FileError(`${count} reference picture sets`, `${MOST_SETS} at most`);
  const sets: (readonly Reference[])[] = [];
  for (let index = 0; index < count; index++) sets.push(referenceSet(bits, index, sets, false));
  return [number, { orderBits, sets, hasPlanesApart }];
}

/** profile_tier_level (7.3.3). */
function skipProfile(bits: BitReader, layers: number): void {
  bits.u(8 + 32 + 48 + 8);
  const present = Array.from({ length: layers - 1 }, () => [bits.flag(), bits.flag()]);
  if (layers > 1) bits.u(2 * (9 - layers));
  for (const [hasProfile, hasLevel] of present) bits.u((hasProfile ? 88 : 0) + (hasLevel ? 8 : 0));
}

/** scaling_list_data (7.3.4). */
function skipScalingLists(bits: BitReader): void {
  for (let size = 0; size < 4; size++) {
    for (let matrix = 0; matrix < 6; matrix += size === 3 ? 3 : 1) {
      if (!bits.flag()) {
        bits.ue();
        continue;
      }
      for (let k = (size > 1 ? 1 : 0) + Math.min(64, 16 << (2 * size)); k > 0; k--) bits.se();
    }
  }
}

/** st_ref_pic_set (7.3.7): past pictures from near to far, then future ones. */
function referenceSet(bits: BitReader, index: number, before: readonly (readonly Reference[])[], isInSlice: boolean): readonly Reference[] {
  if (index > 0 && bits.flag()) return predictedSet(bits, index, before, isInSlice);
  const [past, future] = [bits.ue(), bits.ue()];
  checkCount(past + future);
  const found: Reference[] = [];
  for (const [count, sign] of [[past, -1], [future, 1]]) {
    let step = 0;
    for (let k = 0; k < count; k++) {
      step += sign * (bits.ue() + 1);
      found.push({ step, isUsed: bits.flag() });
    }
  }
  return found;
}

/** A set by its difference from one before (7-61, 7-62). */
function predictedSet(bits: BitReader, index: number, before: readonly (readonly Reference[])[], isInSlice: boolean): readonly Reference[] {
  const back = isInSlice ? bits.ue() + 1 : 1;
  if (back > index) throw new FileError("a reference picture set that builds on none", "one that was sent");
  const sign = bits.flag() ? -1 : 1;
  const shift = sign * (bits.ue() + 1);
  const found: Reference[] = [];
  for (const { step } of [...before[index - back], { step: 0 }]) {
    const isUsed = bits.flag();
    if (isUsed || bits.flag()) found.push({ step: step + shift, isUsed });
  }
  checkCount(found.length);
  // Later sets count through this one in the standard's order.
  const past = found.filter(({ step }) => step < 0).sort((a, b) => b.step - a.step);
  return [...past, ...found.filter(({ step }) => step > 0).sort((a, b) => a.step - b.step)];
}

function checkCount(count: number): void {
  if (count > MOST_REFERENCES) throw new FileError(`${count} reference pictures`, `${MOST_REFERENCES} at most`);
}
