/** frame_num of H.264 pictures (ITU-T H.264, 7.4.3): each one's is the number that follows. */

import { BitReader, payload } from "./bits.ts";
import type { PictureOrder } from "./picture_order.ts";

const [SLICE, IDR_SLICE, SPS] = [1, 5, 7];
const HIGH_PROFILES = [44, 83, 86, 100, 110, 118, 122, 128, 134, 135, 138, 139, 244];
/** More than enough of a slice for its frame_num. */
const HEAD_BYTES = 32;

export class H264Order implements PictureOrder {
  #bits: number | undefined;
  #next: number | undefined;

  follows(data: Uint8Array, isKey: boolean): boolean {
    let isThere = false;
    for (const unit of nalUnits(data)) {
      const kind = unit[0] & 31;
      if (kind === SPS) this.#bits = frameNumBits(new BitReader(payload(unit, 1)));
      if ((kind !== SLICE && kind !== IDR_SLICE) || this.#bits === undefined) continue;
      const slice = new BitReader(payload(unit.subarray(0, HEAD_BYTES), 1));
      if (slice.ue() !== 0) continue; // not the picture's first
      isThere = true;
      slice.ue();
      slice.ue();
      const number = slice.u(this.#bits);
      if (!isKey && number !== this.#next) return false;
      const isReference = (unit[0] & 0x60) !== 0;
      this.#next = isReference ? (number + 1) % 2 ** this.#bits : number;
    }
    return isThere;
  }
}

/** NAL units without start codes. */
export function* nalUnits(data: Uint8Array): Generator<Uint8Array> {
  let start = -1;
  for (let i = 0; i + 2 < data.length; i++) {
    if (data[i] !== 0 || data[i + 1] !== 0 || data[i + 2] !== 1) continue;
    if (start >= 0 && i > start) yield data.subarray(start, i);
    start = i + 3;
    i += 2;
  }
  if (start >= 0 && start < data.length) yield data.subarray(start);
}

/** log2_max_frame_num of a sequence parameter set (7.3.2.1.1). */
function frameNumBits(bits: BitReader): number {
  const profile = bits.u(8);
  bits.u(16); // constraints and level
  bits.ue();
  if (HIGH_PROFILES.includes(profile)) {
    const chroma = bits.ue();
    if (chroma === 3) bits.flag();
    bits.ue();
    bits.ue();
    bits.flag();
    if (bits.flag()) skipScalingLists(bits, chroma === 3 ? 12 : 8);
  }
  return Math.min(bits.ue() + 4, 16);
}

function skipScalingLists(bits: BitReader, count: number): void {
  for (let list = 0; list < count; list++) {
    if (!bits.flag()) continue;
    let scale = 8;
    for (let i = 0; i < (list < 6 ? 16 : 64) && scale !== 0; i++) scale = (scale + bits.se() + 256) % 256;
  }
}
