/** What the cameras really saw: pictures that lie beside the file, to hold views against. */

import type { Viewpoint } from "../geometry.ts";
import type { CameraFrame } from "../synthesis/camera_textures.ts";
import type { Pixels, ViewRenderer } from "../synthesis/renderer.ts";
import { placed, type Shown } from "./shown.ts";
import { TEXTS } from "./texts.ts";

/** An original is asked for again where somebody comes back to it; these few are kept. */
const KEPT = 8;
/** PSNR of pictures without any difference, dB. */
const MOST_DB = 100;

export class Originals {
  readonly #folder: string;
  readonly #size: { readonly width: number; readonly height: number };
  readonly #onCame: (trouble?: string) => void;
  /** By name; undefined: on its way; null: there is none. */
  readonly #found = new Map<string, ImageData | null | undefined>();

  /** `folder`: the address under which `FRAME/ROW/COL.png` are, frames counted as in the encoder's input. */
  constructor(folder: string, size: { width: number; height: number }, onCame: (trouble?: string) => void) {
    this.#folder = folder;
    this.#size = size;
    this.#onCame = onCame;
  }

  /** Give the renderer the picture to compare with, or none where none is asked for or there is none; false while it is fetched. */
  prepare(renderer: ViewRenderer | undefined, frame: number | undefined, shown: Shown): boolean {
    const isDue = shown.look === "difference" && frame !== undefined;
    const found = isDue ? this.#get(frame, placed(shown).view) : null;
    if (renderer !== undefined) renderer.original = found ?? undefined;
    return found !== undefined;
  }

  #get(frame: number, { row, col }: Viewpoint): ImageData | null | undefined {
    const name = `${frame}/${row}/${col}.png`;
    if (!this.#found.has(name)) {
      this.#found.set(name, undefined);
      void this.#fetch(name);
    }
    return this.#found.get(name);
  }

  async #fetch(name: string): Promise<void> {
    const pixels = await fetch(`${this.#folder}/${name}`).then(async (answer) => (answer.ok ? pixelsOf(await answer.blob()) : null)).catch(() => null);
    const isFit = pixels?.width === this.#size.width && pixels.height === this.#size.height;
    this.#found.set(name, isFit ? pixels : null);
    for (const old of this.#found.keys()) {
      if (this.#found.size <= KEPT) break;
      if (old !== name) this.#found.delete(old);
    }
    this.#onCame(isFit ? undefined : TEXTS.noOriginal(`${this.#folder}/${name}`));
  }
}

/** Luma PSNR of a view against what the renderer compares with, dB; undefined where that is nothing. */
export function measure(renderer: ViewRenderer | undefined, frames: readonly CameraFrame[] | undefined, view: Viewpoint): number | undefined {
  if (renderer?.original === undefined || frames === undefined) return undefined;
  return psnr(renderer.read(frames, view, { look: "picture", fine: true, dolly: 0 }), renderer.original);
}

/** Luma PSNR of a view in dB, against an original of the same size. */
export function psnr({ width, height, data }: Pixels, original: ImageData): number {
  const luma = (pixels: Uint8Array | Uint8ClampedArray, i: number) => Math.round(0.299 * pixels[i] + 0.587 * pixels[i + 1] + 0.114 * pixels[i + 2]);
  let squares = 0;
  for (let i = 0; i < data.length; i += 4) squares += (luma(data, i) - luma(original.data, i)) ** 2;
  return squares === 0 ? MOST_DB : 10 * Math.log10((255 ** 2 * width * height) / squares);
}

export async function pixelsOf(blob: Blob): Promise<ImageData> {
  const bitmap = await createImageBitmap(blob, { colorSpaceConversion: "none" });
  const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d")!;
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  return context.getImageData(0, 0, context.canvas.width, context.canvas.height);
}
