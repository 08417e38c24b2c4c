/** What the controls act on: something that shows a recording, whoever decodes and draws it. */

import type { Header } from "../container/header.ts";
import type { Viewpoint } from "../geometry.ts";
import type { Look } from "../synthesis/looks.ts";
import type { Pixels } from "../synthesis/renderer.ts";
import type { Legend } from "./legend.ts";
import type { Section } from "./section.ts";
import type { Shown } from "./shown.ts";

/** How it is played. */
export interface Played {
  readonly isPlaying: boolean;
  readonly speed: number;
  /** What is played over and over; undefined: everything. */
  readonly section: Section | undefined;
}

/** What is seen at a place of the picture: its disparity, px, and distance, m, where that is known. */
export interface Place {
  readonly disparity: number;
  readonly metres: number | undefined;
}

/** Frames count from 0; times are seconds from the first one. Promises resolve when what is asked for is on the screen. */
export interface Engine {
  /** Shows pictures that stand, and those that move unless they are shown elsewhere; see `record`. */
  readonly canvas: HTMLCanvasElement;
  readonly isOpen: boolean;
  readonly isClosed: boolean;
  /** Throws Error before a file is open. */
  readonly header: Header;
  readonly count: number;
  /** More frames may come. */
  readonly isGrowing: boolean;
  /** What it offers, in their order. */
  readonly looks: readonly Look[];
  /** Places of the array besides the real cameras' that have pictures of their own. */
  readonly enhanced: readonly (readonly [row: number, col: number])[];
  /** A view costs so little that it may follow a pointer that only hovers. */
  readonly isLight: boolean;
  readonly canImmerse: boolean;

  /** What is asked for. */
  readonly shown: Readonly<Shown>;
  /** The frame and the viewpoint that are on the screen. */
  readonly frame: number;
  readonly view: Viewpoint;
  readonly playback: Played;
  readonly legend: Legend;
  /** What each eye of a headset sees; undefined where the screen shows the picture. */
  readonly immersed: readonly Viewpoint[] | undefined;
  /** What it is doing, for those who want to know. */
  readonly statistics: string;

  timeOf(frame: number): number;
  frameAt(seconds: number): number;

  seek(frame: number): Promise<void>;
  look(view: Viewpoint): Promise<void>;
  /** Change how it is shown. */
  change(what: Partial<Omit<Shown, "frame" | "view">>): Promise<void>;
  /** The same with all detail. */
  settled(): Promise<void>;
  play(): void;
  pause(): void;
  setSpeed(speed: number): void;
  setSection(section: Section | undefined): void;
  /** Everything that is shown goes to `canvas`, or not all of it. */
  record(isRecorded: boolean): void;
  /** The picture is held, as by a pointer that drags it: it does not come to stand. */
  hold(isHeld: boolean): void;
  /** The view at picture size: as it stands or, not `fine`, as it moves. Throws Error before the first picture. */
  pixels(fine?: boolean): Pixels;
  /** What is seen at a place of the picture, from its upper left in shares of its size; undefined where that is not one view. */
  probe(x: number, y: number): Promise<Place | undefined>;
  /** A small picture of a time, from the nearest camera and keyframe; undefined where there is none. */
  peek(seconds: number): Promise<ImageData | undefined>;
  /** Show it in a headset until the viewer, or `leave`, ends that. Throws Error where that is refused. */
  immerse(): Promise<void>;
  leave(): void;
  close(): void;
}

/** Told to whoever shows the controls. */
export interface EngineEvents {
  /** Another picture is on the screen. */
  onFrame(): void;
  /** Playback, loop, legend or the file's length changed. */
  onState(): void;
  /** What has been waited for a while; undefined: it has come. */
  onWaiting(what: string | undefined): void;
  /** Something is wrong with the file; it goes on where `isFatal` is false. */
  onTrouble(text: string, isFatal: boolean): void;
}
