/** The messages and topics of a file (see FORMAT.md): what is coded, and where it belongs. */

import { BinaryReader, WireType } from "@bufbuild/protobuf/wire";
import { cameras, playsAlone, type Camera } from "../geometry.ts";
import type { Header } from "./header.ts";
import { FileError } from "./limits.ts";

export const HEADER_TOPIC = "/mvcodec/header";
export const LAYER_TOPIC = "/mvcodec/enhancement";

export type TrackKind = "video" | "disparity";

/** One video stream: a real camera's pictures or maps. */
export interface Track {
  readonly topic: string;
  readonly kind: TrackKind;
  readonly camera: Camera;
}

/** All that came of one time. */
export interface FrameSet {
  /** Number in the encoder's input. */
  readonly sequence: number;
  readonly timeNs: bigint;
  /** It has a header: decoding can start here. */
  readonly isKey: boolean;
  /** Topic -> coded picture. */
  readonly units: ReadonlyMap<string, Uint8Array>;
}

/** `/camera/rRR_cCC/video`: at least two digits each. */
export function topicOf(camera: Camera, kind: TrackKind): string {
  const digits = (value: number) => String(value).padStart(2, "0");
  return `/camera/r${digits(camera.row)}_c${digits(camera.col)}/${kind}`;
}

/** Whether a real camera sends a map: with alternate maps, those whose numbers have an even sum. */
export function sendsMap(header: Header, camera: Camera): boolean {
  if (header.mapCameras !== "alternate") return header.mapCameras === "all";
  const sum = header.realRows.indexOf(camera.row) + header.realCols.indexOf(camera.col);
  return sum % 2 === 0;
}

/** Every video stream that a browser can decode: pictures, then maps, cameras in row order. */
export function tracksOf(header: Header): Track[] {
  const all = cameras(header);
  const track = (kind: TrackKind) => (camera: Camera) => ({ topic: topicOf(camera, kind), kind, camera });
  const alone = all.filter((camera) => playsAlone(header, camera));
  return [...alone.map(track("video")), ...all.filter((camera) => sendsMap(header, camera)).map(track("disparity"))];
}

/** Fields of `foxglove.CompressedVideo`. */
const DATA_FIELD = 3;

/** The coded picture in a `foxglove.CompressedVideo`. Throws FileError. */
export function parseVideo(message: Uint8Array): Uint8Array {
  try {
    const reader = new BinaryReader(message);
    let data: Uint8Array | undefined;
    while (reader.pos < reader.len) {
      const [field, type] = reader.tag();
      if (field === DATA_FIELD && type === WireType.LengthDelimited) data = reader.bytes();
      else reader.skip(type, field);
    }
    if (data !== undefined) return data;
  } catch {
    throw new FileError("a damaged video message", "foxglove.CompressedVideo");
  }
  throw new FileError("a video message without data", "foxglove.CompressedVideo");
}
