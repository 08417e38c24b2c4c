/** Real cameras on the GPU: decoded planes made ready for fetching, one layer of an array texture each. */

import type { Header } from "../container/header.ts";
import type { Camera } from "../geometry.ts";
import type { Planes } from "../decode/planes.ts";
import blocksShader from "./blocks.frag.glsl";
import fullShader from "./full.vert.glsl";
import { clampAndFilter, framebufferOf, makeProgram, Texture, type Program } from "./gl.ts";
import prepareShader from "./prepare.frag.glsl";

/** The cameras of a cell. */
export const SLOTS = 4;
/** px, each way, of the blocks that bounds are kept of. */
export const BLOCK = 8;
/** Half-size samples that differ by no more are one surface, px. */
const AGREEMENT_PX = 3;

/** One real camera's picture and map of one frame. */
export interface CameraFrame {
  readonly camera: Camera;
  readonly picture: Planes;
  /** Code values, of the picture's size or half of it, rounded up. */
  readonly map: Uint8Array;
}

export class CameraTextures {
  readonly gl: WebGL2RenderingContext;
  readonly blocks: Texture;
  /** Blocks across and down a picture. */
  readonly grid: readonly [number, number];
  readonly #header: Header;
  readonly #layers: WebGLTexture;
  readonly #prepare: Program;
  readonly #reduce: Program;
  readonly #slots: (CameraFrame | undefined)[] = Array(SLOTS).fill(undefined);
  readonly #layerTarget: WebGLFramebuffer;
  readonly #blockTarget: WebGLFramebuffer;
  readonly #map: Texture;
  #luma: Texture | undefined;
  #chroma: Texture | undefined;
  #pairs = new Uint8Array();

  constructor(gl: WebGL2RenderingContext, header: Header) {
    this.gl = gl;
    this.#header = header;
    const { width, height, mapScale } = header;
    this.grid = [Math.ceil(width / BLOCK), Math.ceil(height / BLOCK)];
    this.#prepare = makeProgram(gl, fullShader, prepareShader);
    this.#reduce = makeProgram(gl, fullShader, blocksShader);
    this.#layers = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.#layers);
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.RGBA8, width, height, SLOTS);
    clampAndFilter(gl, gl.TEXTURE_2D_ARRAY);
    this.#layerTarget = gl.createFramebuffer();
    this.#map = new Texture(gl, 1, Math.ceil(width / mapScale), Math.ceil(height / mapScale));
    this.blocks = new Texture(gl, 2, this.grid[0], this.grid[1] * SLOTS);
    this.#blockTarget = framebufferOf(gl, this.blocks);
  }

  bind(unit: number): void {
    this.gl.activeTexture(this.gl.TEXTURE0 + unit);
    this.gl.bindTexture(this.gl.TEXTURE_2D_ARRAY, this.#layers);
  }

  /** Make these cameras ready, four at most; returns each one's layer. What is there already stays. */
  place(frames: readonly CameraFrame[]): number[] {
    const isThere = (frame: CameraFrame) => this.#slots.some((slot) => slot?.picture === frame.picture && slot.map === frame.map);
    const missing = frames.filter((frame) => !isThere(frame));
    for (const frame of missing) {
      const slot = this.#slots.findIndex((one) => one === undefined || !frames.some((f) => f.picture === one.picture && f.map === one.map));
      this.#slots[slot] = frame;
      this.#upload(frame);
      this.#draw(slot, frame.picture);
    }
    if (missing.length > 0) this.#reduceAll();
    return frames.map((frame) => this.#slots.findIndex((slot) => slot?.picture === frame.picture && slot.map === frame.map));
  }

  #upload({ picture, map }: CameraFrame): void {
    const { gl } = this;
    const [halfWidth, halfHeight] = [(picture.width + 1) >> 1, (picture.height + 1) >> 1];
    if (this.#luma?.width !== picture.width || this.#luma.height !== picture.height) {
      this.#luma?.delete();
      this.#chroma?.delete();
      this.#luma = new Texture(gl, 1, picture.width, picture.height);
      this.#chroma = new Texture(gl, 2, halfWidth, halfHeight);
      this.#pairs = new Uint8Array(2 * halfWidth * halfHeight);
    }
    const { u, v } = picture;
    for (let i = 0; i < u.length; i++) {
      this.#pairs[2 * i] = u[i];
      this.#pairs[2 * i + 1] = v[i];
    }
    this.#luma.upload(picture.y);
    this.#chroma!.upload(this.#pairs);
    this.#map.upload(map);
  }

  #draw(slot: number, picture: Planes): void {
    const { gl } = this;
    const { width, height, mapScale, range } = this.#header;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#layerTarget);
    gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, this.#layers, 0, slot);
    gl.viewport(0, 0, width, height);
    this.#prepare.use();
    this.#luma!.bind(0);
    this.#chroma!.bind(1);
    this.#map.bind(2);
    gl.uniform1i(this.#prepare.at("uLuma"), 0);
    gl.uniform1i(this.#prepare.at("uChroma"), 1);
    gl.uniform1i(this.#prepare.at("uMap"), 2);
    gl.uniform2i(this.#prepare.at("uSize"), width, height);
    gl.uniform2f(this.#prepare.at("uChromaTexel"), 1 / ((picture.width + 1) >> 1), 1 / ((picture.height + 1) >> 1));
    gl.uniform1i(this.#prepare.at("uHalfMap"), mapScale - 1);
    gl.uniform1f(this.#prepare.at("uAgreement"), AGREEMENT_PX / (range[1] - range[0]));
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  #reduceAll(): void {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#blockTarget);
    gl.viewport(0, 0, this.blocks.width, this.blocks.height);
    this.#reduce.use();
    this.bind(0);
    gl.uniform1i(this.#reduce.at("uCameras"), 0);
    gl.uniform2i(this.#reduce.at("uSize"), this.#header.width, this.#header.height);
    gl.uniform1i(this.#reduce.at("uRows"), this.grid[1]);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }
}
