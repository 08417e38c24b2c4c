/** What viewers take with them: a picture, a clip, a link. */

import type { Pixels } from "../synthesis/renderer.ts";
import { element } from "./dom.ts";
import type { Engine } from "./engine.ts";
import { viewText } from "./format.ts";

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

/** Record what a canvas shows for some seconds and offer it as WebM (MP4 where there is no WebM). */
async function saveClip(canvas: HTMLCanvasElement, seconds: number, name: string): Promise<void> {
  const type = ["video/webm;codecs=vp9", "video/webm", "video/mp4"].find((one) => MediaRecorder.isTypeSupported(one));
  const stream = canvas.captureStream();
  const recorder = new MediaRecorder(stream, { ...(type && { mimeType: type }), videoBitsPerSecond: 8e6 });
  const parts: Blob[] = [];
  recorder.ondataavailable = ({ data }) => parts.push(data);
  const isDone = new Promise((resolve) => (recorder.onstop = resolve));
  recorder.start(500);
  setTimeout(() => recorder.stop(), seconds * 1000);
  await isDone;
  stream.getTracks().forEach((track) => track.stop());
  save(new Blob(parts, { type: recorder.mimeType }), `${name}.${recorder.mimeType.includes("mp4") ? "mp4" : "webm"}`);
}

/** Play the loop, or else everything, once, and offer what the canvas shows meanwhile. */
export async function saveLoop(engine: Engine): Promise<void> {
  const { header, playback } = engine;
  const { from, to } = playback.section ?? { from: 0, to: engine.timeOf(engine.count - 1) + 1 / header.fps };
  engine.record(true);
  await engine.seek(engine.frameAt(from));
  engine.play();
  await saveClip(engine.canvas, Math.max((to - from) / playback.speed, 0.2), header.name || "view").finally(() => engine.record(false));
}

/** The page's address with a view and a time, which leads back to them. */
export function linkTo(view: { row: number; col: number }, seconds: number): string {
  const link = new URL(location.href);
  link.hash = "";
  link.searchParams.set("view", viewText(view));
  link.searchParams.set("t", String(Math.round(seconds * 1000) / 1000));
  return link.href;
}
