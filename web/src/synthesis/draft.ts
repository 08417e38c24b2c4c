/** Drafts of views, for pictures that move: made by the processor, since they are for those whose GPU is slow, or none. */

import type { Header } from "../container/header.ts";
import { infinityOf } from "../geometry.ts";
import type { CameraFrame } from "./camera_textures.ts";
import { DraftFetch } from "./draft_fetch.ts";
import { explain } from "./draft_looks.ts";
import type { Look } from "./looks.ts";

/** Cameras that are asked. */
const MOST_CAMERAS = 4;
/** Samples around its place that a moved one covers. */
const REACH = 0.54;
/** px within which disparities are one surface, and by how much farther cameras must outweigh nearer ones; as in `search.glsl`. */
const TOLERANCE = 1.5;
const RATIO = 1.3;
/** px, each way, that share a disparity and colour differences: of a whole picture, and of a smaller one. */
const STEP = 2;
const SMALLER_STEP = 4;

/** Whether drafts can show a look: all but what an original is needed for. */
export function isDrafted(look: Look): boolean {
  return look !== "difference";
}

/** See `ViewSettings`. */
export interface DraftSettings {
  readonly look: Look;
  readonly dolly: number;
  readonly offset?: readonly [number, number];
  readonly wipe?: number;
}

/** A camera that a draft is made from, as the view sees it: px (x, y) from the view to it for each px of disparity. */
export interface DraftCamera {
  readonly frame: CameraFrame;
  readonly shift: readonly [number, number];
  readonly weight: number;
}

/** Numbers below 0 and above 255 -> 0..255. */
const CLAMP_FROM = 512;
const CLAMPED = Uint8Array.from({ length: 3 * CLAMP_FROM }, (_, i) => Math.min(Math.max(i - CLAMP_FROM, 0), 255));

/** What 1 is in whole numbers, and black of a limited range, which is rounded by it too. */
const BITS = 16;
const ONE = 1 << BITS;
const BLACK = Math.round(ONE * (CLAMP_FROM + 0.5 - 16 * (255 / 219)));

export class Draft {
  readonly #header: Header;
  readonly #pixels: Uint32Array<ArrayBuffer>;
  /** By code value: disparity, and how much it is enlarged ahead of the cameras' plane. */
  readonly #px = new Float32Array(256);
  readonly #scale = new Float32Array(256);
  /** Code values within which disparities are one surface. */
  readonly #tolerance: number;
  readonly #found: Uint8Array[];
  readonly #surface: Float32Array;
  /** Places of the two cameras that show a sample, by their order: i + 4 j. */
  readonly #seen: Uint8Array;
  /** How many cameras show a sample, and how far apart the two are in brightness (see `Samples`). */
  readonly #cameras: Uint8Array;
  readonly #away: Float32Array;
  /** What a sample's colour differences add to red, green and blue. */
  readonly #tint: Int16Array;
  #step = STEP;
  #across = 0;
  #down = 0;

  constructor(header: Header) {
    const { width, height, range } = header;
    this.#header = header;
    this.#pixels = new Uint32Array(width * height);
    this.#tolerance = (TOLERANCE * 255) / (range[1] - range[0]);
    const samples = Math.ceil(width / STEP) * Math.ceil(height / STEP);
    this.#found = Array.from({ length: MOST_CAMERAS }, () => new Uint8Array(samples));
    this.#surface = new Float32Array(samples);
    this.#seen = new Uint8Array(samples);
    this.#cameras = new Uint8Array(samples);
    this.#away = new Float32Array(samples);
    this.#tint = new Int16Array(3 * samples);
  }

  /**
   * A view of `width` x `height`: RGBA, rows from the top.
   *
   * The camera that counts most comes first. What is returned holds until the next call.
   */
  make(cameras: readonly DraftCamera[], { look, dolly, offset = [0, 0], wipe = 0 }: DraftSettings, width: number, height: number): Uint8Array<ArrayBuffer> {
    this.#step = width < this.#header.width ? SMALLER_STEP : STEP;
    this.#across = Math.ceil(this.#header.width / this.#step);
    this.#down = Math.ceil(this.#header.height / this.#step);
    this.#prepare(dolly);
    cameras.forEach((camera, i) => this.#move(camera, this.#found[i]));
    this.#vote(cameras.map(({ weight }) => weight));
    this.#fillHoles();
    this.#colour(cameras, dolly);
    this.#paint(cameras, dolly, offset, width, height);
    if (look !== "picture") this.#explain(look, offset, width, height, Math.round(wipe * width));
    return new Uint8Array(this.#pixels.buffer, 0, 4 * width * height);
  }

  #prepare(dolly: number): void {
    const { range } = this.#header;
    const infinity = infinityOf(this.#header);
    for (let code = 0; code < 256; code++) {
      this.#px[code] = range[0] + (code / 255) * (range[1] - range[0]);
      this.#scale[code] = 1 / (1 - dolly * (this.#px[code] - infinity));
    }
  }

  /** px of the first sample's middle. */
  get #first(): number {
    return (this.#header.mapScale - 1) / 2;
  }

  /** The nearest surface that a camera has at each sample of the view; 0: none. */
  #move({ frame: { map }, shift }: DraftCamera, found: Uint8Array): void {
    const { width, height, mapScale } = this.#header;
    const [step, across, down, px, scale] = [this.#step, this.#across, this.#down, this.#px, this.#scale];
    const columns = Math.ceil(width / mapScale);
    const stride = step / mapScale;
    const [middleX, middleY] = [((width - 1) / 2 - this.#first) / step, ((height - 1) / 2 - this.#first) / step];
    const [shiftX, shiftY] = [shift[0] / step, shift[1] / step];
    found.fill(0, 0, across * down);
    for (let j = 0; j < down; j++) {
      const row = j * stride * columns;
      for (let i = 0; i < across; i++) {
        const code = Math.max(map[row + i * stride], 1);
        const d = px[code];
        const larger = scale[code];
        const x = (i - shiftX * d - middleX) * larger + middleX;
        const y = (j - shiftY * d - middleY) * larger + middleY;
        const left = Math.max(Math.ceil(x - REACH), 0);
        const right = Math.min(Math.floor(x + REACH), across - 1);
        const bottom = Math.min(Math.floor(y + REACH), down - 1);
        for (let v = Math.max(Math.ceil(y - REACH), 0); v <= bottom; v++) {
          for (let u = left; u <= right; u++) {
            if (found[v * across + u] < code) found[v * across + u] = code;
          }
        }
      }
    }
  }

  /** Surfaces are tried near to far; a farther one wins where its cameras weigh RATIO times the winner so far. */
  #vote(weights: readonly number[]): void {
    const [tolerance, surface, seen, seers] = [this.#tolerance, this.#surface, this.#seen, this.#cameras];
    const count = weights.length;
    const codes = new Uint8Array(count);
    for (let at = this.#across * this.#down - 1; at >= 0; at--) {
      for (let i = 0; i < count; i++) codes[i] = this.#found[i][at];
      let best = -1;
      let strength = 0;
      let below = 256;
      for (;;) {
        let nearest = 0;
        for (let i = 0; i < count; i++) if (codes[i] < below && codes[i] > nearest) nearest = codes[i];
        if (nearest === 0) break;
        let total = 0;
        let sum = 0;
        let least = nearest;
        for (let i = 0; i < count; i++) {
          if (codes[i] >= below || codes[i] < nearest - tolerance || codes[i] === 0) continue;
          total += weights[i];
          sum += weights[i] * codes[i];
          if (codes[i] < least) least = codes[i];
        }
        if (best < 0 || total > RATIO * strength) {
          best = sum / total;
          strength = total;
        }
        below = least;
      }
      surface[at] = best;
      // The two that count most are enough; of what no camera sees, all know as much.
      let one = -1;
      let other = -1;
      let seeing = 0;
      for (let i = 0; i < count; i++) {
        if (best >= 0 && (codes[i] === 0 || Math.abs(codes[i] - best) > tolerance)) continue;
        seeing++;
        if (one < 0) one = i;
        else if (other < 0) other = i;
      }
      seers[at] = best < 0 ? 0 : seeing;
      seen[at] = one < 0 ? 0 : one + 4 * (other < 0 ? one : other);
    }
  }

  /** What no camera knows is like the farther end of its gap in the row. */
  #fillHoles(): void {
    const surface = this.#surface;
    for (let j = 0; j < this.#down; j++) {
      const end = (j + 1) * this.#across;
      let before = -1;
      for (let at = end - this.#across; at < end; at++) {
        if (surface[at] >= 0) {
          before = surface[at];
          continue;
        }
        let next = at;
        while (next < end && surface[next] < 0) next++;
        const after = next < end ? surface[next] : before;
        surface.fill(before < 0 ? Math.max(after, 0) : Math.min(before, after), at, next);
        at = next - 1;
      }
    }
  }

  /** Colour differences of each sample, from the cameras that show it. */
  #colour(cameras: readonly DraftCamera[], dolly: number): void {
    const { width, height, range } = this.#header;
    const infinity = infinityOf(this.#header);
    const [step, across, surface, tint, away] = [this.#step, this.#across, this.#surface, this.#tint, this.#away];
    const [columns, rows] = [(width + 1) >> 1, (height + 1) >> 1];
    const toPx = (range[1] - range[0]) / 255;
    const [middleX, middleY] = [(width - 1) / 2, (height - 1) / 2];
    for (let j = 0, at = 0; j < this.#down; j++) {
      const y = this.#first + j * step;
      for (let i = 0; i < across; i++, at++) {
        const x = this.#first + i * step;
        const d = range[0] + toPx * surface[at];
        const ahead = dolly * (d - infinity);
        const fromX = x - ahead * (x - middleX);
        const fromY = y - ahead * (y - middleY);
        let cb = 0;
        let cr = 0;
        let total = 0;
        let mean = 0;
        let squares = 0;
        const pair = this.#seen[at];
        for (let k = 0; k < 2; k++) {
          const { frame: { picture }, shift, weight } = cameras[k === 0 ? pair & 3 : pair >> 2];
          const u = Math.min(Math.max(Math.round((fromX + shift[0] * d) / 2), 0), columns - 1);
          const v = Math.min(Math.max(Math.round((fromY + shift[1] * d - 0.5) / 2), 0), rows - 1);
          cb += weight * picture.u[v * columns + u];
          cr += weight * picture.v[v * columns + u];
          total += weight;
          const luma = picture.y[2 * v * 2 * columns + 2 * u];
          mean += weight * luma;
          squares += weight * luma * luma;
        }
        mean /= total;
        away[at] = Math.sqrt(Math.max(squares / total - mean * mean, 0));
        cb = (cb / total - 128) * (255 / 224);
        cr = (cr / total - 128) * (255 / 224);
        tint[3 * at] = 1.5748 * cr;
        tint[3 * at + 1] = -0.18732 * cb - 0.46812 * cr;
        tint[3 * at + 2] = 1.8556 * cb;
      }
    }
  }

  /** Brightness of each pixel, from the two cameras that show its sample: between their pixels for a whole picture, else of the nearest ones. */
  #paint(cameras: readonly DraftCamera[], dolly: number, offset: readonly [number, number], width: number, height: number): void {
    const whole = this.#header;
    const infinity = infinityOf(whole);
    const [surface, seen, tint, pixels] = [this.#surface, this.#seen, this.#tint, this.#pixels];
    const toPx = (whole.range[1] - whole.range[0]) / 255;
    const [middleX, middleY] = [(whole.width - 1) / 2, (whole.height - 1) / 2];
    const stride = 2 * ((whole.width + 1) >> 1);
    const isWhole = width === whole.width;
    // A run of pixels of one sample is read from where its first one lies.
    const [lastX, lastY] = [whole.width - (isWhole ? STEP + 0.001 : SMALLER_STEP), whole.height - 1.001];
    const placesX = placesOf(width, whole.width, offset[0]);
    const placesY = placesOf(height, whole.height, offset[1]);
    const samplesX = this.#samplesOf(placesX, this.#across);
    const samplesY = this.#samplesOf(placesY, this.#down);
    const one = new DraftFetch();
    const other = new DraftFetch();
    for (let j = 0, at = 0; j < height; j++) {
      const y = placesY[j];
      const row = samplesY[j] * this.#across;
      for (let i = 0; i < width; ) {
        const begin = i;
        const column = samplesX[i];
        const sample = row + column;
        while (i < width && samplesX[i] === column) i++;
        const x = placesX[begin];
        const d = whole.range[0] + toPx * surface[sample];
        const ahead = dolly * (d - infinity);
        const fromX = x - ahead * (x - middleX);
        const fromY = y - ahead * (y - middleY);
        const a = cameras[seen[sample] & 3];
        const b = cameras[seen[sample] >> 2];
        const gain = (ONE * (255 / 219)) / (a.weight + b.weight);
        one.aim(fromX + a.shift[0] * d, fromY + a.shift[1] * d, lastX, lastY, stride, gain * a.weight);
        other.aim(fromX + b.shift[0] * d, fromY + b.shift[1] * d, lastX, lastY, stride, gain * b.weight);
        const first = a.frame.picture.y;
        const second = b.frame.picture.y;
        const red = tint[3 * sample];
        const green = tint[3 * sample + 1];
        const blue = tint[3 * sample + 2];
        for (let k = begin; k < i; k++, at++) {
          let sum: number;
          if (isWhole) {
            const p = one.place + k - begin;
            const q = other.place + k - begin;
            sum = first[p] * one.a + first[p + 1] * one.b + first[p + stride] * one.c + first[p + stride + 1] * one.d
              + second[q] * other.a + second[q + 1] * other.b + second[q + stride] * other.c + second[q + stride + 1] * other.d;
          } else {
            const away = placesX[k] - x;
            sum = first[(one.nearest + away) | 0] * one.all + second[(other.nearest + away) | 0] * other.all;
          }
          const grey = (sum + BLACK) >> BITS;
          pixels[at] = 0xff000000 | (CLAMPED[grey + blue] << 16) | (CLAMPED[grey + green] << 8) | CLAMPED[grey + red];
        }
      }
    }
  }

  /** Which of `count` samples in a row, or a column, are shown at some places. */
  #samplesOf(places: Float32Array, count: number): Uint16Array {
    return Uint16Array.from(places, (at) => Math.min(Math.max(Math.floor((at - this.#first) / this.#step + 0.5), 0), count - 1));
  }

  /** Colours of a look in place of the picture's, from column `fromX` on. */
  #explain(look: Look, offset: readonly [number, number], width: number, height: number, fromX: number): void {
    const samplesX = this.#samplesOf(placesOf(width, this.#header.width, offset[0]), this.#across);
    const samplesY = this.#samplesOf(placesOf(height, this.#header.height, offset[1]), this.#down);
    const count = this.#across * this.#down;
    const samples = { count, surface: this.#surface, cameras: this.#cameras, away: this.#away };
    explain(look, samples, this.#pixels, width, height, fromX, (x, y) => samplesY[y] * this.#across + samplesX[x]);
  }
}

/** Where the pixels of a row, or a column, of `count` are in the whole picture's `size`, moved by some px. */
function placesOf(count: number, size: number, by: number): Float32Array {
  return Float32Array.from({ length: count }, (_, i) => ((i + 0.5) * size) / count - 0.5 + by);
}
