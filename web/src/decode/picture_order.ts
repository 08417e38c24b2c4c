/** Whether a picture follows the one before it: decoders would conceal that one is missing (FORMAT.md, damage). */

import type { Codec } from "../container/header.ts";
import { Av1Order } from "./av1_order.ts";
import { H264Order } from "./h264_order.ts";
import { HevcOrder } from "./hevc_order.ts";

/** Follows one track. */
export interface PictureOrder {
  /**
   * Whether nothing is missing before a picture. Where something is, it is as if the picture had not been asked about.
   *
   * `sequence` is the number of its frame set. Throws FileError where its headers are damaged.
   */
  follows(data: Uint8Array, isKey: boolean, sequence: number): boolean;
}

/** VP9's pictures have no numbers: those of the frame sets must do. */
class SequenceOrder implements PictureOrder {
  #last: number | undefined;

  follows(_data: Uint8Array, isKey: boolean, sequence: number): boolean {
    if (!isKey && sequence !== (this.#last ?? sequence - 1) + 1) return false;
    this.#last = sequence;
    return true;
  }
}

export function pictureOrder(codec: Codec): PictureOrder {
  switch (codec) {
    case "h264":
      return new H264Order();
    case "av1":
      return new Av1Order();
    case "vp9":
      return new SequenceOrder();
    case "hevc":
      return new HevcOrder();
  }
}
