/** Reads the fields of a coded picture's headers bit by bit (ITU-T H.264, 7.2 and 9.1; AV1, 4.10). */

import { FileError } from "../container/limits.ts";

/** More leading zeros than a number of 32 bits has are damage. */
const MOST_ZEROS = 32;

/** A NAL unit's content, without its head of so many bytes and its emulation prevention bytes. */
export function payload(unit: Uint8Array, head: number): Uint8Array {
  return unit.subarray(head).filter((byte, i, all) => !(byte === 3 && i >= 2 && all[i - 1] === 0 && all[i - 2] === 0));
}

/** Every method throws FileError where the data end before the field does. */
export class BitReader {
  readonly #data: Uint8Array;
  #at = 0;

  constructor(data: Uint8Array) {
    this.#data = data;
  }

  /** An unsigned number of so many bits. */
  u(count: number): number {
    if (this.#at + count > 8 * this.#data.length) throw new FileError("a header that ends too early", "a whole one");
    let value = 0;
    for (let i = 0; i < count; i++, this.#at++) value = 2 * value + ((this.#data[this.#at >> 3] >> (7 - (this.#at & 7))) & 1);
    return value;
  }

  flag(): boolean {
    return this.u(1) === 1;
  }

  /** An unsigned Exp-Golomb number. */
  ue(): number {
    let zeros = 0;
    while (!this.flag()) {
      if (++zeros > MOST_ZEROS) throw new FileError("a number of more than 32 bits", "a header");
    }
    return 2 ** zeros - 1 + this.u(zeros);
  }

  /** A signed one. */
  se(): number {
    const code = this.ue();
    return code % 2 === 1 ? (code + 1) / 2 : -code / 2;
  }
}
