/** Between which disparities each tile of a view lies: from the bounds of blocks of the cameras' maps, moved there. */

import type { Header } from "../container/header.ts";
import { infinityOf } from "../geometry.ts";

/** px, each way, of blocks and tiles: larger ones cost less to make and more to search. */
export const BLOCK = 16;
/** px around a moved pixel that it may cover, and for rounding. */
const REACH = 1;
/** Cameras, a channel of the textures each. */
const CHANNELS = 4;

/** A camera's map, and px (x, y) from the view to the camera for each px of disparity. */
export interface Moved {
  readonly map: Uint8Array;
  readonly shift: readonly [number, number];
}

export class Bounds {
  /** Tiles across and down a view. */
  readonly across: number;
  readonly down: number;
  /** Of each tile, in each camera's channel: the largest code value, 0 for none; and 255 - the least. See `search.glsl`. */
  readonly nears: Uint8Array;
  readonly fars: Uint8Array;
  readonly #header: Header;
  /** Of each map: the largest and the least code value of each block. */
  readonly #blocks = new WeakMap<Uint8Array, Uint8Array>();

  constructor(header: Header) {
    this.#header = header;
    [this.across, this.down] = [Math.ceil(header.width / BLOCK), Math.ceil(header.height / BLOCK)];
    this.nears = new Uint8Array(CHANNELS * this.across * this.down);
    this.fars = new Uint8Array(CHANNELS * this.across * this.down);
  }

  /** Bound the tiles of a view that stands so far ahead (see `ViewSettings.dolly`); its cameras in the order of their channels. */
  update(cameras: readonly Moved[], dolly: number): void {
    this.nears.fill(0);
    this.fars.fill(0);
    cameras.forEach((camera, channel) => this.#move(camera, channel, dolly));
  }

  #move({ map, shift }: Moved, channel: number, dolly: number): void {
    const { range, width, height } = this.#header;
    const infinity = infinityOf(this.#header);
    const [across, down] = [this.across, this.down];
    const blocks = this.#blocksOf(map);
    const px = (code: number) => range[0] + (code / 255) * (range[1] - range[0]);
    const [middleX, middleY] = [(width - 1) / 2, (height - 1) / 2];
    for (let row = 0; row < down; row++) {
      const [top, bottom] = [row * BLOCK - middleY, row * BLOCK + BLOCK - 1 - middleY];
      for (let col = 0; col < across; col++) {
        const place = row * across + col;
        const [high, low] = [blocks[2 * place], blocks[2 * place + 1]];
        const [far, near] = [px(low), px(high)];
        const [farScale, nearScale] = [1 / (1 - dolly * (far - infinity)), 1 / (1 - dolly * (near - infinity))];
        const [left, right] = [col * BLOCK - middleX, col * BLOCK + BLOCK - 1 - middleX];
        const fromX = Math.min((left - shift[0] * far) * farScale, (left - shift[0] * near) * nearScale) + middleX - REACH;
        const toX = Math.max((right - shift[0] * far) * farScale, (right - shift[0] * near) * nearScale) + middleX + REACH;
        const fromY = Math.min((top - shift[1] * far) * farScale, (top - shift[1] * near) * nearScale) + middleY - REACH;
        const toY = Math.max((bottom - shift[1] * far) * farScale, (bottom - shift[1] * near) * nearScale) + middleY + REACH;
        const [firstCol, lastCol] = [Math.max(Math.floor(fromX / BLOCK), 0), Math.min(Math.floor(toX / BLOCK), across - 1)];
        const [firstRow, lastRow] = [Math.max(Math.floor(fromY / BLOCK), 0), Math.min(Math.floor(toY / BLOCK), down - 1)];
        for (let y = firstRow; y <= lastRow; y++) {
          for (let x = firstCol; x <= lastCol; x++) {
            const at = CHANNELS * (y * across + x) + channel;
            this.nears[at] = Math.max(this.nears[at], high, 1); // 0 stands for nothing
            this.fars[at] = Math.max(this.fars[at], 255 - low);
          }
        }
      }
    }
  }

  #blocksOf(map: Uint8Array): Uint8Array {
    let blocks = this.#blocks.get(map);
    if (blocks === undefined) {
      blocks = blockBounds(map, this.#header, this.across, this.down);
      this.#blocks.set(map, blocks);
    }
    return blocks;
  }
}

/** The largest and the least code value of each block of a map, and of the samples beside it where enlarging looks at those. */
function blockBounds(map: Uint8Array, { width, height, mapScale }: Header, across: number, down: number): Uint8Array {
  const [columns, rows] = [Math.ceil(width / mapScale), Math.ceil(height / mapScale)];
  const samples = BLOCK / mapScale;
  const margin = mapScale > 1 ? 1 : 0;
  const blocks = new Uint8Array(2 * across * down);
  for (let row = 0; row < down; row++) {
    const [top, bottom] = [Math.max(row * samples - margin, 0), Math.min((row + 1) * samples + margin, rows)];
    for (let col = 0; col < across; col++) {
      const [left, right] = [Math.max(col * samples - margin, 0), Math.min((col + 1) * samples + margin, columns)];
      let [high, low] = [0, 255];
      for (let y = top; y < bottom; y++) {
        for (let at = y * columns + left; at < y * columns + right; at++) {
          if (map[at] > high) high = map[at];
          if (map[at] < low) low = map[at];
        }
      }
      blocks[2 * (row * across + col)] = high;
      blocks[2 * (row * across + col) + 1] = low;
    }
  }
  return blocks;
}
