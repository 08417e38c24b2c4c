/** Decodes what is due: one frame after the other, and some ahead while playing. */

import { topicOf } from "../container/messages.ts";
import { frameAt, frameCount, keySpanAt, type Recording } from "../container/recording.ts";
import { FrameStore } from "../decode/frame_store.ts";
import { smallPicture } from "../decode/planes.ts";
import { nearestCamera, type Camera, type Viewpoint } from "../geometry.ts";
import type { CameraFrame } from "../synthesis/camera_textures.ts";

export interface SupplyEvents {
  /** Whether a frame is still wanted; what is not is not decoded. */
  isWanted(frame: number): boolean;
  isPlaying(): boolean;
  /** Something has been decoded: look again. */
  onDecoded(): void;
  /** No camera has a frame, and there is none to show in its place. */
  onMissing(frame: number): void;
  /** A picture has been waited for a while; false: it has come. */
  onWaiting(isWaiting: boolean): void;
  /** Something is wrong with the file; it goes on where `isFatal` is false. */
  onTrouble(text: string, isFatal: boolean): void;
}

export interface Decoded {
  readonly frame: number;
  /** Its number in the encoder's input, where it has one. */
  readonly sequence: number | undefined;
  readonly frames: readonly CameraFrame[];
  /** The cameras that were asked for. */
  readonly asked: string;
}

/** A picture that takes longer is waited for visibly. */
const WAITING_MS = 250;
/** Frames that are decoded ahead while playing. */
const PREFETCH = 4;

export class Supply {
  readonly #recording: Recording;
  readonly #events: SupplyEvents;
  readonly #store: FrameStore;
  #decoded: Decoded | undefined;
  #isFetching = false;
  #peeks: FrameStore | undefined;
  #peeked = 0;
  #isClosed = false;
  /** How long the last frame took to decode. */
  decodeMs = 0;

  constructor(recording: Recording, events: SupplyEvents) {
    this.#recording = recording;
    this.#events = events;
    this.#store = new FrameStore(recording, (text) => events.onTrouble(text, false));
  }

  close(): void {
    this.#isClosed = true;
    this.#store.close();
    this.#peeks?.close();
  }

  /** What there is to be drawn; undefined before the first frame. */
  get decoded(): Decoded | undefined {
    return this.#decoded;
  }

  /** Whether a frame of some cameras is decoded; begins to decode it where it is not. */
  fetch(frame: number, cameras: readonly Camera[]): boolean {
    const asked = cameras.map(({ row, col }) => `${row},${col}`).join(" ");
    if (this.#decoded?.frame === frame && this.#decoded.asked === asked) return true;
    if (!this.#isFetching) void this.#decode(frame, cameras, asked);
    return false;
  }

  /** A small picture of a time, from the nearest camera and keyframe; undefined where it is damaged. */
  async peek(view: Viewpoint, seconds: number, width: number): Promise<ImageData | undefined> {
    const { spans, header } = this.#recording;
    this.#peeks ??= new FrameStore(this.#recording, () => {}); // its decoders do not disturb those that play
    const frame = keySpanAt(spans, frameAt(spans, seconds)).first;
    const topic = topicOf(nearestCamera(header, view), "video");
    const number = ++this.#peeked;
    const planes = await this.#peeks.planes(topic, frame, () => number === this.#peeked);
    return planes && smallPicture(planes, width);
  }

  async #decode(frame: number, cameras: readonly Camera[], asked: string): Promise<void> {
    this.#isFetching = true;
    const events = this.#events;
    const timer = setTimeout(() => events.onWaiting(true), WAITING_MS);
    const since = performance.now();
    try {
      const isWanted = () => events.isPlaying() || events.isWanted(frame);
      const frames = await this.#store.get(frame, cameras, isWanted);
      const sequence = await this.#store.sequence(frame);
      this.decodeMs = performance.now() - since;
      if (frames.length > 0 && !this.#isClosed) this.#decoded = { frame, sequence, frames, asked };
      else if (frames.length === 0 && isWanted()) this.#skip(frame, asked);
      if (events.isPlaying()) this.#prefetch(frame, cameras);
    } catch (error) {
      events.onTrouble((error as Error).message, true);
      return;
    } finally {
      clearTimeout(timer);
      this.#isFetching = false;
      events.onWaiting(false);
    }
    events.onDecoded();
  }

  /** No camera has this frame: the last picture stays, as if it were this one. */
  #skip(frame: number, asked: string): void {
    if (this.#decoded === undefined && frame + 1 < frameCount(this.#recording)) this.#events.onMissing(frame);
    else this.#decoded = { frame, sequence: undefined, frames: this.#decoded?.frames ?? [], asked };
  }

  #prefetch(frame: number, cameras: readonly Camera[]): void {
    const last = Math.min(frame + PREFETCH, frameCount(this.#recording) - 1);
    for (let next = frame + 1; next <= last; next++) {
      void this.#store.get(next, cameras, () => this.#events.isPlaying()).catch(() => {}); // it is asked for again when it is due
    }
  }
}
