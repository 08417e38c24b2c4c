/** Real cameras on the GPU: one layer of each array texture for each. */

import type { Header } from "../container/header.ts";
import type { Camera } from "../geometry.ts";
import type { Planes } from "../decode/planes.ts";
import fullShader from "./full.vert.glsl";
import { ArrayTexture, programOf, type Program } from "./gl.ts";
import prepareShader from "./prepare.frag.glsl";

/** The cameras of a cell. */
export const SLOTS = 4;
/** Half-size samples that differ by no more are one surface, px. */
const AGREEMENT_PX = 3;

/** One real camera's picture and map of one frame. */
export interface CameraFrame {
  readonly camera: Camera;
  /** As large as the header says, sides rounded up to even numbers. */
  readonly picture: Planes;
  /** Code values, of the picture's size or half of it, rounded up. */
  readonly map: Uint8Array;
}

interface Slot extends CameraFrame {
  /** Its layer of `pixels` is ready. */
  isPrepared: boolean;
}

export class CameraTextures {
  readonly luma: ArrayTexture;
  readonly chroma: ArrayTexture;
  readonly maps: ArrayTexture;
  /** Y, Cb, Cr and the map's code value of each pixel: what a fine picture is made of. */
  readonly pixels: ArrayTexture;
  readonly #gl: WebGL2RenderingContext;
  readonly #header: Header;
  readonly #prepare: Program;
  readonly #slots: (Slot | undefined)[] = Array(SLOTS).fill(undefined);
  readonly #layerTarget: WebGLFramebuffer;
  readonly #pairs: Uint8Array;

  constructor(gl: WebGL2RenderingContext, header: Header) {
    this.#gl = gl;
    this.#header = header;
    const { width, height, mapScale } = header;
    const [halfWidth, halfHeight] = [Math.ceil(width / 2), Math.ceil(height / 2)];
    this.#prepare = programOf(gl, fullShader, prepareShader);
    this.luma = new ArrayTexture(gl, 1, 2 * halfWidth, 2 * halfHeight, SLOTS);
    this.chroma = new ArrayTexture(gl, 2, halfWidth, halfHeight, SLOTS);
    this.maps = new ArrayTexture(gl, 1, Math.ceil(width / mapScale), Math.ceil(height / mapScale), SLOTS);
    this.pixels = new ArrayTexture(gl, 4, width, height, SLOTS);
    this.#pairs = new Uint8Array(2 * halfWidth * halfHeight);
    this.#layerTarget = gl.createFramebuffer();
  }

  delete(): void {
    for (const texture of [this.luma, this.chroma, this.maps, this.pixels]) texture.delete();
    this.#gl.deleteFramebuffer(this.#layerTarget);
  }

  /** Make these cameras ready, four at most; returns each one's layer. What is there already stays. */
  place(frames: readonly CameraFrame[]): number[] {
    const isOf = (frame: CameraFrame) => (slot: Slot | undefined) => slot?.picture === frame.picture && slot.map === frame.map;
    for (const frame of frames) {
      if (this.#slots.some(isOf(frame))) continue;
      const layer = this.#slots.findIndex((slot) => slot === undefined || !frames.some((one) => isOf(one)(slot)));
      this.#slots[layer] = { ...frame, isPrepared: false };
      this.#upload(layer, frame);
    }
    const layers = frames.map((frame) => this.#slots.findIndex(isOf(frame)));
    layers.forEach((layer) => this.#prepareLayer(layer));
    return layers;
  }

  #upload(layer: number, { picture, map }: CameraFrame): void {
    const { u, v } = picture;
    for (let i = 0; i < u.length; i++) {
      this.#pairs[2 * i] = u[i];
      this.#pairs[2 * i + 1] = v[i];
    }
    this.luma.upload(layer, picture.y);
    this.chroma.upload(layer, this.#pairs);
    this.maps.upload(layer, map);
  }

  #prepareLayer(layer: number): void {
    const slot = this.#slots[layer]!;
    if (slot.isPrepared) return;
    slot.isPrepared = true;
    const gl = this.#gl;
    const { width, height, mapScale, range } = this.#header;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#layerTarget);
    gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, this.pixels.texture, 0, layer);
    gl.viewport(0, 0, width, height);
    const prepare = this.#prepare;
    prepare.use();
    prepare.textures({ uLuma: this.luma, uChroma: this.chroma, uMaps: this.maps });
    gl.uniform1i(prepare.at("uCamera"), layer);
    gl.uniform2i(prepare.at("uSize"), width, height);
    gl.uniform2f(prepare.at("uChromaTexel"), 1 / this.chroma.width, 1 / this.chroma.height);
    gl.uniform1i(prepare.at("uHalfMap"), mapScale - 1);
    gl.uniform1f(prepare.at("uAgreement"), AGREEMENT_PX / (range[1] - range[0]));
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }
}
