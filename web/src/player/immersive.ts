/** A session of WebXR: the picture as a screen before the viewer, a view for each eye, parallax with the head. */

import type { Header } from "../container/header.ts";
import { convergence, type Viewpoint } from "../geometry.ts";
import type { CameraFrame } from "../synthesis/camera_textures.ts";
import type { ViewRenderer } from "../synthesis/renderer.ts";
import { Screen, type Place } from "../synthesis/screen.ts";
import { eyeCells, viewsOf, type Point } from "./head.ts";
import type { Shown } from "./shown.ts";

/** The screen's longer side and its distance, m: it fills about 53 degrees. */
const SCREEN_M = 2;
const AWAY_M = 2;
/** Between two eyes, where the device shows one only, m. */
const EYES_M = 0.063;

/** Whether this browser has a headset, and may use it here. */
export async function hasHeadset(): Promise<boolean> {
  try {
    return (await navigator.xr?.isSessionSupported("immersive-vr")) ?? false;
  } catch {
    return false; // not allowed within some pages
  }
}

/** What a picture of a headset is made of; `frames` are undefined until the first one is decoded. */
export interface Due {
  readonly frames: readonly CameraFrame[] | undefined;
  readonly shown: Shown;
  /** Share of the picture's size each way. */
  readonly detail: number;
}

export class Immersive {
  readonly #session: XRSession;
  readonly #space: XRReferenceSpace;
  readonly #layer: XRWebGLLayer;
  readonly #renderer: ViewRenderer;
  readonly #header: Header;
  readonly #screen: Screen;
  readonly #home: Viewpoint;
  /** The head's first place, and cells of the array for each metre that it moves. */
  #first: Point | undefined;
  #cellsPerMetre = 0;
  #place: Place | undefined;
  /** Of the left and the right eye, as they are drawn. */
  views: readonly Viewpoint[];

  private constructor(session: XRSession, space: XRReferenceSpace, layer: XRWebGLLayer, renderer: ViewRenderer, header: Header, home: Viewpoint) {
    this.#session = session;
    this.#space = space;
    this.#layer = layer;
    this.#renderer = renderer;
    this.#header = header;
    this.#home = home;
    this.#screen = new Screen(renderer, header);
    this.views = [home];
  }

  /**
   * Begin, from the viewpoint that the head's first place is to see. Throws Error where the viewer or the browser refuses.
   *
   * `due` is asked for each picture of the headset, and told which views are wanted; `onEnd` comes once, whoever ended it.
   */
  static async start(
    renderer: ViewRenderer, header: Header, home: Viewpoint,
    due: (now: number, views: readonly Viewpoint[]) => Due, onEnd: () => void,
  ): Promise<Immersive> {
    const session = await navigator.xr!.requestSession("immersive-vr"); // first: it needs the viewer's click
    try {
      await renderer.gl.makeXRCompatible();
      const layer = new XRWebGLLayer(session, renderer.gl, { alpha: false, depth: false });
      await session.updateRenderState({ baseLayer: layer });
      const immersive = new Immersive(session, await session.requestReferenceSpace("local"), layer, renderer, header, home);
      session.addEventListener("end", () => {
        immersive.#screen.delete();
        onEnd();
      });
      const run = (now: number, frame: XRFrame) => {
        session.requestAnimationFrame(run);
        immersive.#run(now, frame, due);
      };
      session.requestAnimationFrame(run);
      return immersive;
    } catch (error) {
      await session.end().catch(() => {});
      throw error;
    }
  }

  end(): void {
    void this.#session.end().catch(() => {}); // the viewer may have ended it already
  }

  #run(now: number, frame: XRFrame, due: (now: number, views: readonly Viewpoint[]) => Due): void {
    const pose = frame.getViewerPose(this.#space);
    if (!pose) return; // the headset does not know where it is
    const eyes = pose.views.map(({ transform }) => transform.position);
    this.#first ??= this.#begin(pose.transform.position, eyes);
    this.views = viewsOf(this.#header, this.#home, this.#first, eyes, this.#cellsPerMetre);
    const { frames, shown, detail } = due(now, this.views);
    const { gl } = this.#renderer;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#layer.framebuffer);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    if (frames === undefined) return;
    pose.views.forEach((view, i) => {
      const area = this.#layer.getViewport(view);
      if (area === undefined || area.width === 0) return;
      const offset = convergence(this.#header, this.#home, this.views[i], middleOf(this.#header.range));
      const settings = { look: shown.look, fine: false, dolly: shown.dolly, offset };
      const eye = { projection: view.projectionMatrix, fromWorld: view.transform.inverse.matrix, area };
      this.#screen.draw(frames, this.views[i], settings, detail, eye, this.#place!, this.#layer.framebuffer);
    });
  }

  /** The first pose says where the screen stands, and how far apart the eyes are. */
  #begin(head: DOMPointReadOnly, eyes: readonly DOMPointReadOnly[]): Point {
    const apart = eyes.length > 1 ? Math.hypot(eyes[1].x - eyes[0].x, eyes[1].y - eyes[0].y, eyes[1].z - eyes[0].z) : 0;
    this.#cellsPerMetre = eyeCells(this.#header) / (apart || EYES_M);
    const { width, height } = this.#header;
    const scale = SCREEN_M / Math.max(width, height);
    this.#place = { middle: [head.x, head.y, head.z - AWAY_M], extent: [scale * width, scale * height] };
    return head;
  }
}

function middleOf([low, high]: readonly [number, number]): number {
  return (low + high) / 2;
}
