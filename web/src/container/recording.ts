/** A file as a sequence of frame sets by number, whichever way it is read. */

import type { Header } from "./header.ts";
import type { FrameSet } from "./messages.ts";

/** Some frame sets in a row, read together. */
export interface Span {
  /** Number of its first frame set, counted from the file's start. */
  readonly first: number;
  readonly count: number;
  readonly startNs: bigint;
  readonly endNs: bigint;
  /** Its first frame set is a keyframe. */
  readonly isKey: boolean;
}

export interface Recording {
  readonly header: Header;
  /** In order, without gaps; grows where the file does. */
  readonly spans: readonly Span[];
  /** More may come. */
  readonly growing: boolean;
  /** The frame sets of a span; none where it is damaged, which was told. */
  load(span: Span): Promise<readonly FrameSet[]>;
  close(): void;
}

export function frameCount(recording: Recording): number {
  const last = recording.spans.at(-1);
  return last === undefined ? 0 : last.first + last.count;
}

/** The span that holds a frame. */
export function spanAt(spans: readonly Span[], frame: number): Span {
  let low = 0;
  let high = spans.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (spans[middle].first <= frame) low = middle;
    else high = middle - 1;
  }
  return spans[low];
}

/** The last span that begins with a keyframe and not behind a frame's span. */
export function keySpanAt(spans: readonly Span[], frame: number): Span {
  let place = spans.indexOf(spanAt(spans, frame));
  while (place > 0 && !spans[place].isKey) place--;
  return spans[place];
}

/** Seconds of a frame from the first one: exact where its span was read, else between the span's ends. */
export function timeOf(spans: readonly Span[], frame: number): number {
  if (spans.length === 0) return 0;
  const span = spanAt(spans, frame);
  const part = span.count > 1 ? Math.min((frame - span.first) / (span.count - 1), 1) : 0;
  return (Number(span.startNs - spans[0].startNs) + part * Number(span.endNs - span.startNs)) / 1e9;
}

/** The last frame at or before some seconds after the first one. */
export function frameAt(spans: readonly Span[], seconds: number): number {
  const last = spans.at(-1);
  if (last === undefined) return 0;
  let low = 0;
  let high = last.first + last.count - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (timeOf(spans, middle) <= seconds + 1e-6) low = middle;
    else high = middle - 1;
  }
  return low;
}
