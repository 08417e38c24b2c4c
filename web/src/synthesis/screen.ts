/** A screen that stands in space, with a view on it: what each eye of a headset sees. */

import type { Header } from "../container/header.ts";
import type { Viewpoint } from "../geometry.ts";
import type { CameraFrame } from "./camera_textures.ts";
import { framebufferOf, programOf, Texture, type Program } from "./gl.ts";
import type { Area, ViewRenderer, ViewSettings } from "./renderer.ts";
import screenFragment from "./screen.frag.glsl";
import screenVertex from "./screen.vert.glsl";

/** Where the screen stands and how large it is, m; x to the right, y up, it faces +z. */
export interface Place {
  readonly middle: readonly [number, number, number];
  readonly extent: readonly [number, number];
}

/** How an eye looks at the world: matrices by columns, and its part of the target. */
export interface Eye {
  readonly projection: Float32Array;
  readonly fromWorld: Float32Array;
  readonly area: Area;
}

export class Screen {
  readonly #renderer: ViewRenderer;
  readonly #header: Header;
  readonly #program: Program;
  readonly #picture: Texture;
  readonly #pictureTarget: WebGLFramebuffer;

  constructor(renderer: ViewRenderer, header: Header) {
    this.#renderer = renderer;
    this.#header = header;
    this.#program = programOf(renderer.gl, screenVertex, screenFragment);
    this.#picture = new Texture(renderer.gl, 4, header.width, header.height);
    this.#pictureTarget = framebufferOf(renderer.gl, this.#picture);
  }

  /** Draw a view, with a share of the picture's size each way, on the screen as an eye sees it; around it the target stays as it was. */
  draw(
    frames: readonly CameraFrame[], view: Viewpoint, settings: ViewSettings, detail: number,
    eye: Eye, place: Place, target: WebGLFramebuffer | null,
  ): void {
    const { gl } = this.#renderer;
    const width = Math.max(Math.round(this.#header.width * detail), 1);
    const height = Math.max(Math.round(this.#header.height * detail), 1);
    this.#renderer.draw(frames, view, settings, { x: 0, y: 0, width, height }, this.#pictureTarget);
    const program = this.#program;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.viewport(eye.area.x, eye.area.y, eye.area.width, eye.area.height);
    program.use();
    program.textures({ uPicture: this.#picture });
    gl.uniformMatrix4fv(program.at("uProjection"), false, eye.projection);
    gl.uniformMatrix4fv(program.at("uFromWorld"), false, eye.fromWorld);
    gl.uniform3f(program.at("uMiddle"), ...place.middle);
    gl.uniform2f(program.at("uExtent"), ...place.extent);
    gl.uniform2f(program.at("uFilled"), width, height);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  delete(): void {
    this.#renderer.gl.deleteFramebuffer(this.#pictureTarget);
    this.#picture.delete();
  }
}
