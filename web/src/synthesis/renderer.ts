/** Views of decoded frames, drawn by WebGL 2. */

import type { Header } from "../container/header.ts";
import { contributors, infinityOf, type Viewpoint } from "../geometry.ts";
import { BLOCK, Bounds } from "./bounds.ts";
import { CameraTextures, SLOTS, type CameraFrame } from "./camera_textures.ts";
import copyFragment from "./copy.frag.glsl";
import { Draft, isDrafted, type DraftCamera } from "./draft.ts";
import fullVertex from "./full.vert.glsl";
import { framebufferOf, programOf, Texture, type Program } from "./gl.ts";
import { LOOKS, type Look } from "./looks.ts";
import searchShader from "./search.glsl";
import viewFragment from "./view.frag.glsl";

const RAW = LOOKS.length;

export interface ViewSettings {
  readonly look: Look;
  /** Disparity in 16 bits in place of the look. */
  readonly raw?: boolean;
  /** Cubic fetch and soft contours; else a draft, or linear fetch where a draft cannot show it. */
  readonly fine: boolean;
  /** How far the view stands ahead of the cameras' plane: 1 / the disparity of what it would touch, px from infinity. */
  readonly dolly: number;
  /** Share of the width, from the left, that shows the picture whatever the look. */
  readonly wipe?: number;
  /** px that the picture is moved by. */
  readonly offset?: readonly [number, number];
  /** How much of what was drawn before this replaces; everything where absent. */
  readonly share?: number;
  /** Which of red, green and blue are drawn. */
  readonly mask?: readonly [boolean, boolean, boolean];
}

/** RGBA, rows from the top. */
export interface Pixels {
  readonly width: number;
  readonly height: number;
  readonly data: Uint8Array;
}

/** What of the cameras and the view the passes must know, the camera that counts most first. */
interface Seen {
  readonly layers: Int32Array;
  readonly shifts: Float32Array;
  readonly weights: Float32Array;
  readonly dolly: number;
}

/** Part of a target: where a view is drawn, px from the lower left. */
export interface Area {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

export class ViewRenderer {
  readonly gl: WebGL2RenderingContext;
  /** What the look `difference` compares with, of the picture's size; without one it shows the picture. */
  original: ImageData | undefined;
  #uploaded: ImageData | undefined;
  readonly #originalTexture: Texture;
  readonly #header: Header;
  readonly #cameras: CameraTextures;
  readonly #bounds: Bounds;
  /** See `search.glsl`. */
  readonly #near: Texture;
  readonly #far: Texture;
  readonly #view: Program;
  readonly #draft: Draft;
  readonly #copy: Program;
  readonly #draftTexture: Texture;

  /** Throws Error where there is no WebGL 2. */
  constructor(canvas: HTMLCanvasElement | OffscreenCanvas, header: Header) {
    const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false, powerPreference: "high-performance" });
    if (gl === null) throw new Error("this browser has no WebGL 2");
    this.gl = gl as WebGL2RenderingContext;
    this.#header = header;
    this.#cameras = new CameraTextures(this.gl, header);
    this.#bounds = new Bounds(header);
    this.#near = new Texture(this.gl, 4, this.#bounds.across, this.#bounds.down);
    this.#far = new Texture(this.gl, 4, this.#bounds.across, this.#bounds.down);
    this.#view = programOf(this.gl, fullVertex, searchShader + viewFragment);
    this.#originalTexture = new Texture(this.gl, 4, header.width, header.height);
    this.#draft = new Draft(header);
    this.#copy = programOf(this.gl, fullVertex, copyFragment);
    this.#draftTexture = new Texture(this.gl, 4, header.width, header.height);
  }

  /**
   * Draw a view into an area of a framebuffer; null is the canvas.
   *
   * `frames` are those of the cell's cameras that have a picture; they are uploaded where they are new.
   */
  draw(frames: readonly CameraFrame[], view: Viewpoint, settings: ViewSettings, area: Area, target: WebGLFramebuffer | null): void {
    const cameras = this.#seeing(frames, view, settings.dolly);
    if (!settings.fine && isDrafted(settings.look) && !settings.raw) this.#drawDraft(cameras, settings, area, target);
    else this.#drawView(cameras, settings, area, target);
  }

  /** A draft of a view, for whoever shows it: RGBA, rows from the top. What is returned holds until the next draft. */
  draft(frames: readonly CameraFrame[], view: Viewpoint, settings: Omit<ViewSettings, "fine">, width: number, height: number): Uint8Array<ArrayBuffer> {
    return this.#draft.make(this.#seeing(frames, view, settings.dolly), settings, width, height);
  }

  /** Disparity of one pixel of a view, px, and whether any camera sees it. */
  probe(frames: readonly CameraFrame[], view: Viewpoint, settings: ViewSettings, x: number, y: number): { disparity: number; isSeen: boolean } {
    const { width, height, range } = this.#header;
    const texture = new Texture(this.gl, 4, 1, 1);
    const target = framebufferOf(this.gl, texture);
    this.draw(frames, view, { ...settings, fine: false, raw: true }, { x: -x, y: -y, width, height }, target);
    const data = new Uint8Array(4);
    this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, target);
    this.gl.readPixels(0, 0, 1, 1, this.gl.RGBA, this.gl.UNSIGNED_BYTE, data);
    this.gl.deleteFramebuffer(target);
    texture.delete();
    const share = (data[0] + data[1] / 255) / 255;
    return { disparity: range[0] + share * (range[1] - range[0]), isSeen: data[2] === 0 };
  }

  /** Draw the middle of a fine view, a share of its sides, where nobody sees it: to find out how long that takes. */
  drawMiddle(frames: readonly CameraFrame[], view: Viewpoint, share: number): void {
    const { width, height } = this.#header;
    const texture = new Texture(this.gl, 4, Math.ceil(share * width), Math.ceil(share * height));
    const target = framebufferOf(this.gl, texture);
    const area = { x: (texture.width - width) >> 1, y: (texture.height - height) >> 1, width, height };
    this.draw(frames, view, { look: "picture", fine: true, dolly: 0 }, area, target);
    this.gl.deleteFramebuffer(target);
    texture.delete();
  }

  /** A view's pixels at picture size. */
  read(frames: readonly CameraFrame[], view: Viewpoint, settings: ViewSettings): Pixels {
    const { gl } = this;
    const { width, height } = this.#header;
    const texture = new Texture(gl, 4, width, height);
    const target = framebufferOf(gl, texture);
    this.draw(frames, view, settings, { x: 0, y: 0, width, height }, target);
    const data = new Uint8Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, data);
    gl.deleteFramebuffer(target);
    texture.delete();
    return { width, height, data };
  }

  /** Let go of what the GPU holds; programs stay for the next one. */
  delete(): void {
    for (const texture of [this.#near, this.#far, this.#originalTexture, this.#draftTexture]) texture.delete();
    this.#cameras.delete();
  }

  /** The cameras that have a share in a view, the one that counts most first. */
  #seeing(frames: readonly CameraFrame[], view: Viewpoint, dolly: number): DraftCamera[] {
    const at = (frame: CameraFrame, row: number, col: number) => frame.camera.row === row && frame.camera.col === col;
    const seeing = contributors(this.#header, view, ({ row, col }) => frames.some((frame) => at(frame, row, col)));
    const own = seeing.find(({ camera }) => camera.row === view.row && camera.col === view.col);
    const used = own === undefined || dolly !== 0 ? seeing.sort((a, b) => b.weight - a.weight) : [own];
    return used.map(({ camera, shift, weight }) => ({ frame: frames.find((one) => at(one, camera.row, camera.col))!, shift, weight }));
  }

  #drawDraft(cameras: readonly DraftCamera[], settings: ViewSettings, area: Area, target: WebGLFramebuffer | null): void {
    const [width, height] = [Math.min(area.width, this.#header.width), Math.min(area.height, this.#header.height)];
    this.#draftTexture.upload(this.#draft.make(cameras, settings, width, height), width, height);
    const copy = this.#copy;
    copy.use();
    copy.textures({ uPicture: this.#draftTexture });
    this.gl.uniform2i(copy.at("uSize"), width, height);
    this.#drawArea(copy, settings, area, target);
  }

  #drawView(cameras: readonly DraftCamera[], settings: ViewSettings, area: Area, target: WebGLFramebuffer | null): void {
    const seen: Seen = {
      layers: new Int32Array(SLOTS), shifts: new Float32Array(2 * SLOTS), weights: new Float32Array(SLOTS), dolly: settings.dolly,
    };
    seen.layers.set(this.#cameras.place(cameras.map(({ frame }) => frame)));
    cameras.forEach(({ shift, weight }, i) => {
      seen.shifts.set(shift, 2 * i);
      seen.weights[i] = weight;
    });
    this.#bounds.update(cameras.map(({ frame, shift }) => ({ map: frame.map, shift })), settings.dolly);
    this.#near.upload(this.#bounds.nears);
    this.#far.upload(this.#bounds.fars);
    const { gl } = this;
    const view = this.#view;
    const look = settings.look === "difference" && this.original === undefined ? "picture" : settings.look;
    if (look === "difference" && this.#uploaded !== this.original) this.#originalTexture.upload(this.original!.data);
    if (look === "difference") this.#uploaded = this.original;
    view.use();
    view.textures({ uCameras: this.#cameras.pixels, uNear: this.#near, uFar: this.#far, uOriginal: this.#originalTexture });
    this.#describe(view, seen);
    gl.uniform1f(view.at("uTile"), BLOCK);
    gl.uniform2i(view.at("uSize"), this.#header.width, this.#header.height);
    gl.uniform1f(view.at("uWipe"), settings.wipe ?? 0);
    gl.uniform1i(view.at("uLook"), settings.raw ? RAW : LOOKS.indexOf(look));
    gl.uniform1i(view.at("uFine"), settings.fine ? 1 : 0);
    gl.uniform1i(view.at("uSoftens"), seen.weights.filter((weight) => weight > 0).length > 1 ? 1 : 0);
    this.#drawArea(view, settings, area, target);
  }

  /** The last pass of a view. */
  #drawArea(program: Program, settings: ViewSettings, area: Area, target: WebGLFramebuffer | null): void {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.viewport(area.x, area.y, area.width, area.height);
    gl.uniform4f(program.at("uArea"), area.x, area.y, area.width, area.height);
    gl.uniform1i(program.at("uFromTop"), target === null ? 0 : 1);
    gl.uniform2f(program.at("uOffset"), ...(settings.offset ?? [0, 0]));
    const [red, green, blue] = settings.mask ?? [true, true, true];
    gl.colorMask(red, green, blue, true);
    if (settings.share !== undefined) {
      gl.enable(gl.BLEND);
      gl.blendEquation(gl.FUNC_ADD);
      gl.blendColor(0, 0, 0, settings.share);
      gl.blendFunc(gl.CONSTANT_ALPHA, gl.ONE_MINUS_CONSTANT_ALPHA);
    }
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.BLEND);
    gl.colorMask(true, true, true, true);
  }

  /** What the shader must know of the cameras and the view. */
  #describe(program: Program, { layers, shifts, weights, dolly }: Seen): void {
    const { gl } = this;
    const { width, height, range } = this.#header;
    gl.uniform4iv(program.at("uLayer"), layers);
    gl.uniform4f(program.at("uShiftX"), shifts[0], shifts[2], shifts[4], shifts[6]);
    gl.uniform4f(program.at("uShiftY"), shifts[1], shifts[3], shifts[5], shifts[7]);
    gl.uniform4fv(program.at("uWeight"), weights);
    gl.uniform2f(program.at("uRange"), ...range);
    gl.uniform3f(program.at("uDolly"), dolly, (width - 1) / 2, (height - 1) / 2);
    gl.uniform1f(program.at("uInfinity"), infinityOf(this.#header));
  }
}
