/** Any frame of a recording, decoded: only the tracks that are asked for, the latest ones kept. */

import type { Tell } from "../container/assembly.ts";
import type { Header } from "../container/header.ts";
import { sendsMap, topicOf } from "../container/messages.ts";
import { keySpanAt, spanAt, timeOf, type Recording } from "../container/recording.ts";
import type { Camera } from "../geometry.ts";
import type { CameraFrame } from "../synthesis/camera_textures.ts";
import { deriveMap, helpersOf } from "./derived_map.ts";
import { planeBytes, type Planes } from "./planes.ts";
import { TrackDecoder, type Unit } from "./track_decoder.ts";

/** Decoded planes that are kept, bytes. */
const KEPT_BYTES = 192 << 20;
/** Coded pictures put in beyond the one that is waited for, so that a decoder that works ahead can. */
const AHEAD = 3;

interface TrackState {
  readonly decoder: TrackDecoder;
  /** Jobs of a track follow each other. */
  tail: Promise<unknown>;
}

export class FrameStore {
  readonly #recording: Recording;
  readonly #tell: Tell;
  readonly #tracks = new Map<string, TrackState>();
  readonly #planes = new Map<string, Planes>();
  readonly #maps = new WeakMap<Planes, Uint8Array>();
  readonly #told = new Set<string>();
  readonly #flat: Uint8Array;
  #bytes = 0;

  constructor(recording: Recording, tell: Tell) {
    this.#recording = recording;
    this.#tell = tell;
    const { width, height, mapScale } = recording.header;
    this.#flat = new Uint8Array(Math.ceil(width / mapScale) * Math.ceil(height / mapScale));
  }

  /**
   * What the given cameras have at a frame; a camera without picture or map there is left out.
   *
   * `isWanted` is asked before work begins: what nobody waits for any more is skipped. Throws NoDecoder.
   */
  async get(frame: number, wanted: readonly Camera[], isWanted: () => boolean = () => true): Promise<CameraFrame[]> {
    const found = await Promise.all(
      wanted.map(async (camera) => {
        const [picture, map] = await Promise.all([
          this.planes(topicOf(camera, "video"), frame, isWanted),
          this.#map(camera, frame, isWanted),
        ]);
        return picture !== undefined && map !== undefined ? { camera, picture, map } : undefined;
      }),
    );
    return found.filter((one) => one !== undefined);
  }

  /** The number that a frame has in the encoder's input; undefined where it is damaged. */
  async sequence(frame: number): Promise<number | undefined> {
    const span = spanAt(this.#recording.spans, frame);
    return (await this.#recording.load(span))[frame - span.first]?.sequence;
  }

  /** A track's decoded picture; undefined where it is missing or damaged. */
  async planes(topic: string, frame: number, isWanted: () => boolean = () => true): Promise<Planes | undefined> {
    const name = `${topic}@${frame}`;
    const kept = this.#planes.get(name);
    if (kept !== undefined) return kept;
    const track = this.#track(topic);
    const job = track.tail.then(async () => {
      if (!this.#planes.has(name) && isWanted()) await this.#decode(track.decoder, topic, frame);
      return this.#planes.get(name);
    });
    track.tail = job.catch(() => {});
    return job;
  }

  close(): void {
    for (const { decoder } of this.#tracks.values()) decoder.close();
    this.#tracks.clear();
    this.#planes.clear();
  }

  /** Code values of a camera's map, cropped; derived where it sends none, and flat where none does. */
  async #map(camera: Camera, frame: number, isWanted: () => boolean): Promise<Uint8Array | undefined> {
    const { header } = this.#recording;
    if (header.mapCameras === "none") return this.#flat;
    const senders = sendsMap(header, camera) ? [camera] : helpersOf(header, camera);
    const planes = await Promise.all(senders.map((sender) => this.planes(topicOf(sender, "disparity"), frame, isWanted)));
    const first = planes[0];
    if (sendsMap(header, camera)) return first && this.#cropped(first);
    const maps = senders.flatMap((sender, i) => {
      const map = planes[i];
      return map === undefined ? [] : [{ camera: sender, codes: this.#cropped(map) }];
    });
    if (maps.length === 0) return undefined;
    const picture = await this.planes(topicOf(camera, "video"), frame, isWanted);
    if (picture === undefined) return undefined;
    let derived = this.#maps.get(picture);
    if (derived === undefined) {
      derived = deriveMap(header, camera, maps);
      this.#maps.set(picture, derived);
    }
    return derived;
  }

  #cropped(map: Planes): Uint8Array {
    let codes = this.#maps.get(map);
    if (codes === undefined) {
      const { header } = this.#recording;
      codes = cropPlane(map.y, map.width, Math.ceil(header.width / header.mapScale), Math.ceil(header.height / header.mapScale));
      this.#maps.set(map, codes);
    }
    return codes;
  }

  #track(topic: string): TrackState {
    let track = this.#tracks.get(topic);
    if (track === undefined) {
      const size = codedSize(this.#recording.header, topic);
      const decoder = new TrackDecoder(this.#recording.header.codec, (frame, planes) => {
        if (planes.width === size.width && planes.height === size.height) this.#keep(`${topic}@${frame}`, planes);
      });
      track = { decoder, tail: Promise.resolve() };
      this.#tracks.set(topic, track);
    }
    return track;
  }

  #keep(name: string, planes: Planes): void {
    if (this.#planes.has(name)) return;
    this.#planes.set(name, planes);
    this.#bytes += planeBytes(planes);
    for (const [old, gone] of this.#planes) {
      if (this.#bytes <= KEPT_BYTES || old === name) break;
      this.#planes.delete(old);
      this.#bytes -= planeBytes(gone);
    }
  }

  async #decode(decoder: TrackDecoder, topic: string, frame: number): Promise<void> {
    const key = await this.#keyBefore(frame);
    const first = decoder.next > key && decoder.next <= frame ? decoder.next : key;
    const span = spanAt(this.#recording.spans, frame);
    const last = Math.min(frame + AHEAD, span.first + span.count - 1); // what is behind it may not be loaded yet
    const units: Unit[] = [];
    for (let at = first; at <= last; at++) units.push(await this.#unit(topic, at));
    const end = units.findIndex((unit) => unit.frame > frame && (unit.isKey || unit.data === undefined));
    const isThere = (await decoder.decode(end < 0 ? units : units.slice(0, end), frame)) && this.#planes.has(`${topic}@${frame}`);
    if (!isThere && !this.#told.has(`${topic}@${key}`)) {
      this.#told.add(`${topic}@${key}`);
      const at = timeOf(this.#recording.spans, frame).toFixed(3);
      this.#tell(`${topic} at ${at} s: it cannot be decoded; the camera is left out up to its next keyframe`);
    }
  }

  async #unit(topic: string, frame: number): Promise<Unit> {
    const span = spanAt(this.#recording.spans, frame);
    const set = (await this.#recording.load(span))[frame - span.first];
    return { frame, isKey: set?.isKey ?? false, sequence: set?.sequence ?? -1, data: set?.units.get(topic) };
  }

  async #keyBefore(frame: number): Promise<number> {
    const from = keySpanAt(this.#recording.spans, frame).first;
    for (let at = frame; at > from; at--) {
      const span = spanAt(this.#recording.spans, at);
      if ((await this.#recording.load(span))[at - span.first]?.isKey) return at;
    }
    return from;
  }
}

/** What a track's pictures measure: the sides of its pictures or maps, rounded up to even numbers. */
function codedSize({ width, height, mapScale }: Header, topic: string): { width: number; height: number } {
  const scale = topic.endsWith("/disparity") ? mapScale : 1;
  const even = (side: number) => 2 * Math.ceil(Math.ceil(side / scale) / 2);
  return { width: even(width), height: even(height) };
}

/** The upper left part of a plane. */
export function cropPlane(plane: Uint8Array, stride: number, width: number, height: number): Uint8Array {
  if (stride === width) return plane.subarray(0, width * height);
  const out = new Uint8Array(width * height);
  for (let y = 0; y < height; y++) out.set(plane.subarray(y * stride, y * stride + width), y * width);
  return out;
}
