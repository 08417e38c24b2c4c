/** Small things about WebGL 2 that its API says at length. */

/** What each context has compiled: without a GPU that takes half a second of its processor. */
const COMPILED = new WeakMap<WebGL2RenderingContext, Map<string, Program>>();

/** The program of two shaders, compiled once. Throws Error with the driver's own words. */
export function programOf(gl: WebGL2RenderingContext, vertex: string, fragment: string): Program {
  const compiled = COMPILED.get(gl) ?? new Map<string, Program>();
  COMPILED.set(gl, compiled);
  const key = `${vertex}\0${fragment}`;
  const program = compiled.get(key) ?? makeProgram(gl, vertex, fragment);
  compiled.set(key, program);
  return program;
}

/** The context was lost, and with it what it has compiled. */
export function forgetPrograms(gl: WebGL2RenderingContext): void {
  COMPILED.delete(gl);
}

function makeProgram(gl: WebGL2RenderingContext, vertex: string, fragment: string): Program {
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]] as const) {
    const shader = gl.createShader(kind)!;
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
      throw new Error(`a shader that does not compile: ${gl.getShaderInfoLog(shader)}`);
    }
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new Error(`shaders that do not link: ${gl.getProgramInfoLog(program)}`);
  }
  return new Program(gl, program);
}

/** A program and where its uniforms are. */
export class Program {
  readonly #gl: WebGL2RenderingContext;
  readonly #program: WebGLProgram;
  readonly #places = new Map<string, WebGLUniformLocation | null>();

  constructor(gl: WebGL2RenderingContext, program: WebGLProgram) {
    this.#gl = gl;
    this.#program = program;
  }

  use(): void {
    this.#gl.useProgram(this.#program);
  }

  /** Bind textures for its samplers. */
  textures(byName: Readonly<Record<string, Bindable>>): void {
    Object.entries(byName).forEach(([name, texture], unit) => {
      texture.bind(unit);
      this.#gl.uniform1i(this.at(name), unit);
    });
  }

  at(name: string): WebGLUniformLocation | null {
    let place = this.#places.get(name);
    if (place === undefined) {
      place = this.#gl.getUniformLocation(this.#program, name);
      this.#places.set(name, place);
    }
    return place;
  }
}

/** How often it is looked whether the GPU has finished, ms. */
const POLL_MS = 8;

/** Resolves when the GPU has done all that it was asked for so far. */
export function finished(gl: WebGL2RenderingContext): Promise<void> {
  const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  gl.flush();
  return new Promise((resolve) => {
    const look = () => {
      if (fence !== null && gl.clientWaitSync(fence, 0, 0) === gl.TIMEOUT_EXPIRED) {
        setTimeout(look, POLL_MS);
        return;
      }
      gl.deleteSync(fence);
      resolve();
    };
    look();
  });
}

export interface Bindable {
  bind(unit: number): void;
}

/** Several textures of one size in one, a layer each; filtered between pixels, not between layers. */
export class ArrayTexture implements Bindable {
  readonly texture: WebGLTexture;
  readonly width: number;
  readonly height: number;
  readonly #gl: WebGL2RenderingContext;
  readonly #format: number;

  constructor(gl: WebGL2RenderingContext, channels: Channels, width: number, height: number, layers: number) {
    this.#gl = gl;
    [this.width, this.height] = [width, height];
    this.texture = gl.createTexture();
    const { format, stored } = formatOf(gl, channels);
    this.#format = format;
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.texture);
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, stored, width, height, layers);
    clampAndFilter(gl, gl.TEXTURE_2D_ARRAY);
  }

  upload(layer: number, pixels: Uint8Array): void {
    const gl = this.#gl;
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, layer, this.width, this.height, 1, this.#format, gl.UNSIGNED_BYTE, pixels);
  }

  bind(unit: number): void {
    this.#gl.activeTexture(this.#gl.TEXTURE0 + unit);
    this.#gl.bindTexture(this.#gl.TEXTURE_2D_ARRAY, this.texture);
  }

  delete(): void {
    this.#gl.deleteTexture(this.texture);
  }
}

/** A texture of one size and format for good; filtered between its pixels, not repeated. */
export class Texture implements Bindable {
  readonly texture: WebGLTexture;
  readonly width: number;
  readonly height: number;
  readonly #gl: WebGL2RenderingContext;

  constructor(gl: WebGL2RenderingContext, channels: Channels, width: number, height: number) {
    this.#gl = gl;
    [this.width, this.height] = [width, height];
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, formatOf(gl, channels).stored, width, height);
    clampAndFilter(gl, gl.TEXTURE_2D);
  }

  /** `pixels`: RGBA, of the texture's size or of a part of it that begins where the texture does. */
  upload(pixels: Uint8Array | Uint8ClampedArray, width = this.width, height = this.height): void {
    const gl = this.#gl;
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  }

  bind(unit: number): void {
    this.#gl.activeTexture(this.#gl.TEXTURE0 + unit);
    this.#gl.bindTexture(this.#gl.TEXTURE_2D, this.texture);
  }

  delete(): void {
    this.#gl.deleteTexture(this.texture);
  }
}

type Channels = 1 | 2 | 4;

function formatOf(gl: WebGL2RenderingContext, channels: Channels): { format: number; stored: number } {
  switch (channels) {
    case 1:
      return { format: gl.RED, stored: gl.R8 };
    case 2:
      return { format: gl.RG, stored: gl.RG8 };
    case 4:
      return { format: gl.RGBA, stored: gl.RGBA8 };
  }
}

function clampAndFilter(gl: WebGL2RenderingContext, target: number): void {
  for (const axis of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(target, axis, gl.CLAMP_TO_EDGE);
  for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, filter, gl.LINEAR);
}

/** A target that draws into textures. */
export function framebufferOf(gl: WebGL2RenderingContext, ...textures: Texture[]): WebGLFramebuffer {
  const framebuffer = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
  const attachments = textures.map((_, i) => gl.COLOR_ATTACHMENT0 + i);
  textures.forEach(({ texture }, i) => gl.framebufferTexture2D(gl.FRAMEBUFFER, attachments[i], gl.TEXTURE_2D, texture, 0));
  gl.drawBuffers(attachments);
  return framebuffer;
}
