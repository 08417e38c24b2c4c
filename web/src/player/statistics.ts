/** What the player is doing, for those who want to know. */

import type { Engine } from "./engine.ts";
import { bytesText, viewText } from "./format.ts";

/** Of a page that decodes by itself. Times in ms. */
export interface PageWork {
  /** Between pictures while they move. */
  readonly interval: number;
  readonly detail: number;
  readonly decodeMs: number;
  readonly requests: number;
  readonly bytes: number;
}

export function pageStatistics(engine: Engine, { interval, detail, decodeMs, requests, bytes }: PageWork): string {
  const { header } = engine;
  return [
    ...whatIsShown(engine),
    `picture  ${header.width} x ${header.height} ${header.codec}, ${header.realRows.length} x ${header.realCols.length} cameras`,
    `moving   ${(interval > 0 ? 1000 / interval : 0).toFixed(0)}/s at ${percent(detail)} detail`,
    `decoded  ${decodeMs.toFixed(0)} ms for the last frame`,
    `network  ${requests} requests, ${bytesText(bytes)}`,
  ].join("\n");
}

/** Of a server that sends pictures: what it says of the last one. */
export interface ServerWork {
  readonly decode_ms: number;
  readonly synthesis_ms: number;
  readonly encode_ms: number;
  readonly transfer_ms: number | null;
  readonly dropped: number;
  readonly scale: number;
  readonly quick: boolean;
  readonly enhanced: boolean;
}

export function serverStatistics(engine: Engine, synthesizer: string, rate: number, work: ServerWork): string {
  const { header } = engine;
  const kind = [work.quick ? "draft" : "", work.scale < 1 ? `at ${percent(work.scale)} size` : "", work.enhanced ? "enhanced" : ""];
  return [
    ...whatIsShown(engine),
    `picture  ${header.width} x ${header.height} ${header.codec}, by ${[synthesizer, ...kind.filter(Boolean)].join(", ")}`,
    `rate     ${rate}/s, ${work.dropped} dropped`,
    `server   decode ${ms(work.decode_ms)}, synthesis ${ms(work.synthesis_ms)}, encode ${ms(work.encode_ms)}`,
    `network  ${ms(work.transfer_ms)} until it is shown`,
  ].join("\n");
}

function whatIsShown({ frame, count, view, header }: Engine): string[] {
  return [`frame    ${frame} (0..${count - 1})`, `view     ${viewText(view)} of ${header.rows} x ${header.cols}`];
}

function percent(share: number): string {
  return `${Math.round(100 * share)} %`;
}

function ms(value: number | null): string {
  return value === null ? "-" : `${value.toFixed(0)} ms`;
}
