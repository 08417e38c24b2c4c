/** What looks make of a draft: the colours of `view.frag.glsl`, for the samples that a draft knows. */

import type { Look } from "./looks.ts";

/** A draft's samples, in rows. */
export interface Samples {
  readonly count: number;
  /** The code value of what is seen. */
  readonly surface: Float32Array;
  /** How many cameras see it. */
  readonly cameras: Uint8Array;
  /** How far apart their brightness is: its deviation, in code values. */
  readonly away: Float32Array;
}

type Colour = readonly [red: number, green: number, blue: number];

const FAR: Colour = [0.05, 0.07, 0.35];
const MIDDLE: Colour = [0.75, 0.2, 0.45];
const NEAR: Colour = [1, 0.95, 0.4];
const LAYERS = 12;
const DISAGREEMENT_GAIN = 12;
const SEEN_BY: readonly Colour[] = [
  [0.9, 0.2, 0.2], [0.95, 0.7, 0.2], ...[2, 3, 4].map((count): Colour => [0.1, 0.35 + 0.15 * count, 0.4]),
];

/** By code value. */
const RAMP = Array.from({ length: 256 }, (_, code) => ramp(code / 255));
const LAYER_RAMP = Array.from({ length: 256 }, (_, code) => ramp((Math.floor((code / 255) * (LAYERS - 0.01)) + 0.5) / LAYERS));

/** How a look's colour and the picture's green make a pixel: colour * (own + tinted * green) + grey * green, all 0..1. */
function mixOf(look: Look): { own: number; tinted: number; grey: number } {
  if (look === "layers") return { own: 0.35, tinted: 0.65, grey: 0 };
  return look === "provenance" ? { own: 0.7, tinted: 0, grey: 0.3 } : { own: 1, tinted: 0, grey: 0 };
}

/** Give a draft the colours of a look that explains it; `sampleAt`: the sample of a pixel of row `y`, from column `fromX` on. */
export function explain(
  look: Look, samples: Samples, pixels: Uint32Array, width: number, height: number, fromX: number,
  sampleAt: (x: number, y: number) => number,
): void {
  const { own, tinted, grey } = mixOf(look);
  const colours = coloursOf(look, samples);
  for (let y = 0; y < height; y++) {
    for (let x = fromX, at = y * width + fromX; x < width; x++, at++) {
      const green = ((pixels[at] >> 8) & 255) / 255;
      const share = own + tinted * green;
      const base = 255 * grey * green;
      const place = 3 * sampleAt(x, y);
      const red = share * colours[place] + base;
      pixels[at] = 0xff000000 | ((share * colours[place + 2] + base) << 16) | ((share * colours[place + 1] + base) << 8) | red;
    }
  }
}

/** Red, green and blue of each sample, 0..255. */
function coloursOf(look: Look, { count, surface, cameras, away }: Samples): Uint8Array {
  const colours = new Uint8Array(3 * count);
  for (let at = 0; at < count; at++) {
    const colour = look === "provenance" ? SEEN_BY[cameras[at]]
      : look === "disagreement" ? RAMP[Math.min(Math.round(DISAGREEMENT_GAIN * away[at]), 255)]
        : (look === "layers" ? LAYER_RAMP : RAMP)[Math.round(surface[at])];
    for (let channel = 0; channel < 3; channel++) colours[3 * at + channel] = 255 * colour[channel];
  }
  return colours;
}

function ramp(share: number): Colour {
  const [from, to, part] = share < 0.5 ? [FAR, MIDDLE, 2 * share] : [MIDDLE, NEAR, 2 * share - 1];
  const mix = (channel: 0 | 1 | 2) => from[channel] + part * (to[channel] - from[channel]);
  return [mix(0), mix(1), mix(2)];
}
