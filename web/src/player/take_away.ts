/** What viewers take with them: a picture, a clip, a link. */

import type { Pixels } from "../synthesis/renderer.ts";
import { element } from "./dom.ts";
import type { Engine } from "./engine.ts";
import { viewText } from "./format.ts";
import { TEXTS } from "./texts.ts";

const LONGEST_BEGINNING_S = 3;

function wait(seconds: number): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve, seconds * 1000));
}

/** Offer a file for saving. */
function save(blob: Blob, name: string): void {
  const link = element("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

/** Offer a view as PNG. */
export async function savePicture(pixels: Pixels, name: string): Promise<void> {
  const canvas = new OffscreenCanvas(pixels.width, pixels.height);
  const data = new Uint8ClampedArray(pixels.data.length);
  data.set(pixels.data);
  canvas.getContext("2d")!.putImageData(new ImageData(data, pixels.width, pixels.height), 0, 0);
  save(await canvas.convertToBlob({ type: "image/png" }), `${name}.png`);
}

/** Record what a canvas shows for some seconds, from `play` on, and offer it as WebM (MP4 where there is no WebM). */
async function saveClip(canvas: HTMLCanvasElement, play: () => void, seconds: number, name: string): Promise<void> {
  const type = ["video/webm;codecs=vp9", "video/webm", "video/mp4"].find((one) => MediaRecorder.isTypeSupported(one));
  const stream = canvas.captureStream();
  const recorder = new MediaRecorder(stream, { ...(type && { mimeType: type }), videoBitsPerSecond: 8e6 });
  const parts: Blob[] = [];
  const isDone = new Promise((resolve) => (recorder.onstop = resolve));
  // A browser that is busy may take longer than a short clip lasts until the first picture is coded.
  const hasBegun = new Promise<void>((resolve) => {
    recorder.ondataavailable = ({ data }) => {
      parts.push(data);
      if (data.size > 0) resolve();
    };
  });
  recorder.start(100);
  play(); // behind it, so that the first pictures are recorded too
  await Promise.all([wait(seconds), Promise.race([hasBegun, wait(seconds + LONGEST_BEGINNING_S)])]);
  recorder.stop();
  await isDone;
  stream.getTracks().forEach((track) => track.stop());
  if (parts.every((part) => part.size === 0)) throw new Error(TEXTS.nothingRecorded);
  save(new Blob(parts, { type: recorder.mimeType }), `${name}.${recorder.mimeType.includes("mp4") ? "mp4" : "webm"}`);
}

/** Play the loop, or else everything, once, and offer what the canvas shows meanwhile. */
export async function saveLoop(engine: Engine): Promise<void> {
  const { header, playback } = engine;
  const { from, to } = playback.section ?? { from: 0, to: engine.timeOf(engine.count - 1) + 1 / header.fps };
  engine.record(true);
  await engine.seek(engine.frameAt(from));
  await saveClip(engine.canvas, () => engine.play(), Math.max((to - from) / playback.speed, 0.2), header.name || "view").finally(() => engine.record(false));
}

/** The page's address with a view and a time, which leads back to them. */
export function linkTo(view: { row: number; col: number }, seconds: number): string {
  const link = new URL(location.href);
  link.hash = "";
  link.searchParams.set("view", viewText(view));
  link.searchParams.set("t", String(Math.round(seconds * 1000) / 1000));
  return link.href;
}
