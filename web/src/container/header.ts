/** The header of a file (`mvcodec.Header`, see FORMAT.md), read and checked. */

import { checkLimit, FileError } from "./limits.ts";

export type Codec = "h264" | "hevc" | "av1" | "vp9";

export type MapCameras = "all" | "alternate" | "none";

const CODECS: readonly Codec[] = ["h264", "hevc", "av1", "vp9"];
/** Version 2 adds files without maps, and cameras that are predicted from others. */
const VERSIONS = [1, 2];
const VERSION_WITHOUT_MAPS = 2;
const VERSION_WITH_PREDICTION = 2;
const MOST_SIDE = 1024;
const MOST_PIXELS = 16384;

export interface Calibration {
  readonly fx: number;
  readonly fy: number;
  readonly baselineM: number;
  /** Disparity of infinitely distant points for each step, px. */
  readonly dInf: number;
  /** False: nominal values stand in, metres mean nothing. */
  readonly given: boolean;
}

export interface Header {
  readonly codec: Codec;
  readonly rows: number;
  readonly cols: number;
  readonly width: number;
  readonly height: number;
  readonly fps: number;
  readonly realRows: readonly number[];
  readonly realCols: readonly number[];
  readonly rho: number;
  readonly name: string;
  readonly calibration: Calibration;
  /** [lo, hi], px: what code values 0 and 255 of a map mean. */
  readonly range: readonly [number, number];
  /** 2: maps have half the pictures' size each way. */
  readonly mapScale: 1 | 2;
  /** Which real cameras send a map. */
  readonly mapCameras: MapCameras;
  /** [row, col] of the cameras whose pictures are coded from those of others, in a way that browsers cannot decode. */
  readonly predicted: readonly (readonly [number, number])[];
  /** Views of the file's enhancement layer, which this player shows as synthesised. */
  readonly enhancedViews: number;
  /** As it stands in the file, for those who compare it. */
  readonly document: unknown;
}

/** Reads typed values out of a JSON object; what is missing or of another type names its key. */
class Fields {
  readonly #object: Record<string, unknown>;
  readonly #at: string;

  constructor(value: unknown, at: string) {
    if (typeof value !== "object" || value === null || Array.isArray(value)) {
      throw new FileError(`header ${at || "document"}: ${describe(value)}`, "an object");
    }
    this.#object = value as Record<string, unknown>;
    this.#at = at;
  }

  get(key: string, fallback?: unknown): unknown {
    const value = Object.hasOwn(this.#object, key) ? this.#object[key] : fallback;
    if (value === undefined) throw new FileError(`a header without ${this.#at}${key}`, "one with it");
    return value;
  }

  inner(key: string): Fields {
    return new Fields(this.get(key), `${this.#at}${key}.`);
  }

  number(key: string): number {
    const value = this.get(key);
    if (typeof value !== "number" || !Number.isFinite(value)) throw this.wrong(key, value, "a number");
    return value;
  }

  positive(key: string): number {
    const value = this.number(key);
    if (value <= 0) throw this.wrong(key, value, "a positive number");
    return value;
  }

  whole(key: string, least: number, most: number): number {
    const value = this.get(key);
    if (!Number.isInteger(value) || (value as number) < least || (value as number) > most) {
      throw this.wrong(key, value, `a whole number, ${least}..${most}`);
    }
    return value as number;
  }

  wrong(key: string, value: unknown, expected: string): FileError {
    return new FileError(`header ${this.#at}${key}: ${describe(value)}`, expected);
  }
}

/** Read a header's JSON text. Throws FileError. */
export function parseHeader(text: Uint8Array): Header {
  checkLimit("headerBytes", text.length, "bytes of a header");
  let document: unknown;
  try {
    document = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(text));
  } catch {
    throw new FileError("a header that is not JSON", "UTF-8 JSON");
  }
  const fields = new Fields(document, "");
  if (fields.get("format") !== "mvcodec") throw fields.wrong("format", fields.get("format"), '"mvcodec"');
  const version = fields.get("version") as number;
  if (!VERSIONS.includes(version)) throw fields.wrong("version", version, `version ${VERSIONS.join(" or ")}, which this player reads`);
  const codec = fields.get("codec") as Codec;
  if (!CODECS.includes(codec)) throw fields.wrong("codec", codec, CODECS.join(", "));
  const array = readArray(fields.inner("array"));
  return { codec, ...array, ...readMaps(fields, version), predicted: readPredicted(fields, version, array), enhancedViews: 0, document };
}

/** How many views the header of an enhancement layer names; 0 where it says nothing of the kind. */
export function countEnhanced(text: Uint8Array): number {
  try {
    const { views } = JSON.parse(new TextDecoder().decode(text));
    return Array.isArray(views) ? views.length : 0;
  } catch {
    return 0;
  }
}

function readArray(array: Fields) {
  const rows = array.whole("rows", 1, MOST_SIDE);
  const cols = array.whole("cols", 1, MOST_SIDE);
  const width = array.whole("width", 1, MOST_PIXELS);
  const height = array.whole("height", 1, MOST_PIXELS);
  const realRows = realPlaces(array, "real_rows", rows);
  const realCols = realPlaces(array, "real_cols", cols);
  const cameras = realRows.length * realCols.length;
  checkLimit("cameras", cameras, "real cameras");
  checkLimit("views", rows * cols, "views");
  checkLimit("setPixels", width * height * cameras, "pixels of a frame set");
  const name = array.get("name", "");
  if (typeof name !== "string") throw array.wrong("name", name, "a text");
  return {
    rows, cols, width, height, realRows, realCols, name,
    fps: array.positive("fps"),
    rho: array.positive("rho"),
    calibration: readCalibration(array.inner("calibration")),
  };
}

function readCalibration(fields: Fields): Calibration {
  return {
    fx: fields.positive("fx_px"),
    fy: fields.positive("fy_px"),
    baselineM: fields.positive("baseline_m"),
    dInf: fields.number("d_inf_px_per_step"),
    given: fields.get("given") === true,
  };
}

function readMaps(fields: Fields, version: number) {
  const range = fields.get("disparity_range_px");
  if (!isPair(range) || !(range[0] < range[1])) {
    throw fields.wrong("disparity_range_px", range, "[lo, hi] with lo < hi");
  }
  const mapScale = fields.get("disparity_scale", 1);
  if (mapScale !== 1 && mapScale !== 2) throw fields.wrong("disparity_scale", mapScale, "1 or 2");
  const mapCameras = fields.get("disparity_cameras", "all") as MapCameras;
  const known = version >= VERSION_WITHOUT_MAPS ? ["all", "alternate", "none"] : ["all", "alternate"];
  if (!known.includes(mapCameras)) throw fields.wrong("disparity_cameras", mapCameras, known.join(", "));
  return { range, mapScale, mapCameras } as const;
}

/** The cameras that a prediction names; at least one other must play alone. */
function readPredicted(fields: Fields, version: number, array: ReturnType<typeof readArray>): [number, number][] {
  if (version < VERSION_WITH_PREDICTION || fields.get("prediction", null) === null) return [];
  const prediction = fields.inner("prediction");
  const cameras = prediction.get("cameras");
  const all = array.realRows.length * array.realCols.length;
  if (!Array.isArray(cameras) || cameras.length >= all) throw prediction.wrong("cameras", cameras, `a list of fewer than ${all} cameras`);
  return cameras.map((one: unknown) => {
    const place = new Fields(one, "prediction.cameras").get("camera");
    const isReal = Array.isArray(place) && place.length === 2 && array.realRows.includes(place[0]) && array.realCols.includes(place[1]);
    if (!isReal) throw prediction.wrong("cameras", place, "[row, col] of a real camera");
    return [place[0], place[1]];
  });
}

/** Equally spaced places from the first to the last. */
function realPlaces(array: Fields, key: string, count: number): number[] {
  const places = array.get(key);
  const expected = `equally spaced places from 0 to ${count - 1}`;
  if (!Array.isArray(places) || places.length < 1 || places.length > count || !places.every(Number.isInteger)) {
    throw array.wrong(key, places, expected);
  }
  const step = places.length > 1 ? (count - 1) / (places.length - 1) : 0;
  if ((places.length === 1 && count > 1) || !places.every((place, i) => place === i * step)) {
    throw array.wrong(key, places, expected);
  }
  return places as number[];
}

function isPair(value: unknown): value is [number, number] {
  return Array.isArray(value) && value.length === 2 && value.every(Number.isFinite);
}

function describe(value: unknown): string {
  const text = JSON.stringify(value) ?? String(value);
  return text.length > 60 ? `${text.slice(0, 57)}...` : text;
}
