/** Between which disparities each tile of a view lies: from the bounds of blocks of the cameras' maps, moved there. */

import type { Header } from "../container/header.ts";
import blocksShader from "./blocks.frag.glsl";
import boundsFragment from "./bounds.frag.glsl";
import boundsVertex from "./bounds.vert.glsl";
import { SLOTS } from "./camera_textures.ts";
import fullShader from "./full.vert.glsl";
import { framebufferOf, makeProgram, Texture, type ArrayTexture, type Program } from "./gl.ts";

export class Bounds {
  /** px, each way, of blocks and tiles. */
  readonly block: number;
  /** See `search.glsl`. */
  readonly near: Texture;
  readonly far: Texture;
  readonly #gl: WebGL2RenderingContext;
  readonly #mapScale: number;
  readonly #margin: number;
  /** Blocks across and down a picture, and tiles of the view. */
  readonly #grid: readonly [number, number];
  readonly #blocks: Texture;
  readonly #blockTarget: WebGLFramebuffer;
  readonly #target: WebGLFramebuffer;
  readonly #reduce: Program;
  readonly #move: Program;
  /** Which maps the blocks are of. */
  #version = -1;

  /** `margin`: samples of a map around a block that its pixels may take their disparity from. */
  constructor(gl: WebGL2RenderingContext, header: Header, block: number, margin: number) {
    this.#gl = gl;
    this.block = block;
    this.#mapScale = header.mapScale;
    this.#margin = margin;
    const [across, down] = [Math.ceil(header.width / block), Math.ceil(header.height / block)];
    this.#grid = [across, down];
    this.#blocks = new Texture(gl, 2, across, down * SLOTS);
    this.#blockTarget = framebufferOf(gl, this.#blocks);
    this.near = new Texture(gl, 4, across, down);
    this.far = new Texture(gl, 4, across, down);
    this.#target = framebufferOf(gl, this.near, this.far);
    this.#reduce = makeProgram(gl, fullShader, blocksShader);
    this.#move = makeProgram(gl, boundsVertex, boundsFragment);
  }

  /** Bound the tiles of a view of `count` cameras, which `describe` tells the program about; `version` says which maps these are. */
  draw(maps: ArrayTexture, version: number, count: number, describe: (program: Program) => void): void {
    if (this.#version !== version) this.#boundBlocks(maps);
    this.#version = version;
    const gl = this.#gl;
    const [across, down] = this.#grid;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#target);
    gl.viewport(0, 0, across, down);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.enable(gl.BLEND);
    gl.blendEquation(gl.MAX);
    const move = this.#move;
    move.use();
    move.textures({ uBlocks: this.#blocks });
    gl.uniform2i(move.at("uGrid"), across, down);
    gl.uniform1f(move.at("uBlock"), this.block);
    describe(move);
    gl.drawArrays(gl.POINTS, 0, across * down * count);
    gl.disable(gl.BLEND);
  }

  #boundBlocks(maps: ArrayTexture): void {
    const gl = this.#gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#blockTarget);
    gl.viewport(0, 0, this.#blocks.width, this.#blocks.height);
    const reduce = this.#reduce;
    reduce.use();
    reduce.textures({ uMaps: maps });
    gl.uniform2i(reduce.at("uMapSize"), maps.width, maps.height);
    gl.uniform1i(reduce.at("uSamples"), this.block / this.#mapScale);
    gl.uniform1i(reduce.at("uMargin"), this.#margin);
    gl.uniform1i(reduce.at("uRows"), this.#grid[1]);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }
}
