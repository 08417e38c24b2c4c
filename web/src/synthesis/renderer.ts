/** Views of decoded frames, drawn by WebGL 2. */

import type { Header } from "../container/header.ts";
import { contributors, infinityOf, type Viewpoint } from "../geometry.ts";
import { Bounds } from "./bounds.ts";
import { CameraTextures, SLOTS, type CameraFrame } from "./camera_textures.ts";
import draftFragment from "./draft.frag.glsl";
import fullVertex from "./full.vert.glsl";
import geometryFragment from "./geometry.frag.glsl";
import { framebufferOf, makeProgram, Texture, type Program } from "./gl.ts";
import searchShader from "./search.glsl";
import viewFragment from "./view.frag.glsl";

/** What a view shows, in the order of `view.frag.glsl`. */
export const LOOKS = ["picture", "disparity", "layers", "provenance", "disagreement", "difference"] as const;
export type Look = (typeof LOOKS)[number];
const RAW = LOOKS.length;

export interface ViewSettings {
  readonly look: Look;
  /** Disparity in 16 bits in place of the look. */
  readonly raw?: boolean;
  /** Cubic fetch and soft contours; else quick: a draft of the picture, and other looks by linear fetch. */
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

/** px, each way, of the tiles that a picture's bounds are kept of: larger ones cost less to make and more to search. */
const FINE_BLOCK = 8;
const DRAFT_BLOCK = 16;

/** What of the cameras and the view the passes must know, the camera that counts most first. */
interface Seen {
  readonly count: number;
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
  readonly #fineBounds: Bounds;
  readonly #draftBounds: Bounds;
  readonly #view: Program;
  readonly #geometry: Program;
  readonly #draft: Program;
  readonly #surface: Texture;
  readonly #geometryTarget: WebGLFramebuffer;

  /** Throws Error where there is no WebGL 2. */
  constructor(canvas: HTMLCanvasElement | OffscreenCanvas, header: Header) {
    const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false, powerPreference: "high-performance" });
    if (gl === null) throw new Error("this browser has no WebGL 2");
    this.gl = gl as WebGL2RenderingContext;
    this.#header = header;
    this.#cameras = new CameraTextures(this.gl, header);
    this.#fineBounds = new Bounds(this.gl, header, FINE_BLOCK, header.mapScale > 1 ? 1 : 0); // enlarging looks at the samples around
    this.#draftBounds = new Bounds(this.gl, header, DRAFT_BLOCK, 0);
    this.#view = makeProgram(this.gl, fullVertex, searchShader + viewFragment);
    const { width, height } = this.#cameras.chroma;
    this.#surface = new Texture(this.gl, 4, width, height);
    this.#geometryTarget = framebufferOf(this.gl, this.#surface);
    this.#originalTexture = new Texture(this.gl, 4, header.width, header.height);
    this.#geometry = makeProgram(this.gl, fullVertex, searchShader + geometryFragment);
    this.#draft = makeProgram(this.gl, fullVertex, draftFragment);
  }

  /**
   * Draw a view into an area of a framebuffer; null is the canvas.
   *
   * `frames` are those of the cell's cameras that have a picture; they are uploaded where they are new.
   */
  draw(frames: readonly CameraFrame[], view: Viewpoint, settings: ViewSettings, area: Area, target: WebGLFramebuffer | null): void {
    const at = (frame: CameraFrame, row: number, col: number) => frame.camera.row === row && frame.camera.col === col;
    const seeing = contributors(this.#header, view, ({ row, col }) => frames.some((frame) => at(frame, row, col)));
    const own = seeing.find(({ camera }) => camera.row === view.row && camera.col === view.col);
    const used = own === undefined || settings.dolly !== 0 ? seeing.sort((a, b) => b.weight - a.weight) : [own];
    const isDraft = !settings.fine && settings.look === "picture" && !settings.raw;
    const layers = this.#cameras.place(used.map(({ camera }) => frames.find((frame) => at(frame, camera.row, camera.col))!), !isDraft);
    const seen: Seen = {
      count: used.length, layers: new Int32Array(SLOTS), shifts: new Float32Array(2 * SLOTS), weights: new Float32Array(SLOTS), dolly: settings.dolly,
    };
    seen.layers.set(layers);
    used.forEach(({ shift, weight }, i) => {
      seen.shifts.set(shift, 2 * i);
      seen.weights[i] = weight;
    });
    const bounds = isDraft ? this.#draftBounds : this.#fineBounds;
    bounds.draw(this.#cameras.maps, this.#cameras.version, seen.count, (program) => this.#describe(program, seen, 1, 0));
    if (isDraft) this.#drawDraft(seen, settings, area, target);
    else this.#drawView(seen, settings, area, target);
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

  /** Surfaces at one place of 2 x 2 pixels, or of 4 x 4 for a smaller picture, then each pixel's brightness. */
  #drawDraft(seen: Seen, settings: ViewSettings, area: Area, target: WebGLFramebuffer | null): void {
    const { gl } = this;
    const { luma, chroma, maps } = this.#cameras;
    const { width, height, mapScale } = this.#header;
    const step = area.width < width ? 4 : 2;
    const first = (mapScale - 1) / 2; // the middle of a map's first sample
    const [across, down] = [Math.ceil(width / step), Math.ceil(height / step)];
    const geometry = this.#geometry;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#geometryTarget);
    gl.viewport(0, 0, across, down);
    geometry.use();
    geometry.textures({ uMaps: maps, uChroma: chroma, uNear: this.#draftBounds.near, uFar: this.#draftBounds.far });
    this.#describe(geometry, seen, 1 / step, first);
    gl.uniform1f(geometry.at("uTile"), DRAFT_BLOCK / step);
    gl.uniform2i(geometry.at("uSize"), across, down);
    gl.uniform1i(geometry.at("uTwoSuffice"), 1);
    gl.uniform1i(geometry.at("uMapStep"), step / mapScale);
    gl.uniform1f(geometry.at("uChromaStep"), step / 2);
    gl.uniform2i(geometry.at("uChromaSize"), chroma.width, chroma.height);
    gl.drawArrays(gl.TRIANGLES, 0, 3);

    const draft = this.#draft;
    draft.use();
    draft.textures({ uSurface: this.#surface, uLuma: luma });
    this.#describe(draft, seen, 1, 0);
    gl.uniform2i(draft.at("uSize"), width, height);
    gl.uniform1f(draft.at("uStep"), step);
    gl.uniform1f(draft.at("uFirst"), first);
    gl.uniform2i(draft.at("uSurfaceSize"), across, down);
    gl.uniform2f(draft.at("uLumaTexel"), 1 / luma.width, 1 / luma.height);
    this.#drawArea(draft, settings, area, target);
  }

  #drawView(seen: Seen, settings: ViewSettings, area: Area, target: WebGLFramebuffer | null): void {
    const { gl } = this;
    const view = this.#view;
    const look = settings.look === "difference" && this.original === undefined ? "picture" : settings.look;
    if (look === "difference" && this.#uploaded !== this.original) this.#originalTexture.upload(this.original!);
    if (look === "difference") this.#uploaded = this.original;
    view.use();
    view.textures({ uCameras: this.#cameras.pixels, uNear: this.#fineBounds.near, uFar: this.#fineBounds.far, uOriginal: this.#originalTexture });
    this.#describe(view, seen, 1, 0);
    gl.uniform1f(view.at("uTile"), FINE_BLOCK);
    gl.uniform1i(view.at("uTwoSuffice"), 0);
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

  /** What all passes must know of the cameras and the view; `scale`: samples of the pass across a px, the first one at `first` px. */
  #describe(program: Program, { layers, shifts, weights, dolly }: Seen, scale: number, first: number): void {
    const { gl } = this;
    const { width, height, range } = this.#header;
    gl.uniform4iv(program.at("uLayer"), layers);
    gl.uniform2fv(program.at("uShift"), shifts.map((shift) => scale * shift));
    gl.uniform4fv(program.at("uWeight"), weights);
    gl.uniform2f(program.at("uRange"), ...range);
    gl.uniform3f(program.at("uDolly"), dolly, scale * ((width - 1) / 2 - first), scale * ((height - 1) / 2 - first));
    gl.uniform1f(program.at("uInfinity"), infinityOf(this.#header));
  }
}
