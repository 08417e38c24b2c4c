/** What the player is doing, for those who want to know. */

import type { Engine } from "./engine.ts";
import { bytesText, viewText } from "./format.ts";

export function statistics(engine: Engine): string {
  const { header, shown, tempo, traffic } = engine;
  const rate = tempo.interval > 0 ? 1000 / tempo.interval : 0;
  return [
    `frame    ${engine.frame} (0..${engine.count - 1})`,
    `view     ${viewText(shown.view)} of ${header.rows} x ${header.cols}`,
    `picture  ${header.width} x ${header.height} ${header.codec}, ${header.realRows.length} x ${header.realCols.length} cameras`,
    `moving   ${rate.toFixed(0)}/s at ${Math.round(100 * tempo.detail)} % detail`,
    `decoded  ${engine.decodeMs.toFixed(0)} ms for the last frame`,
    `network  ${traffic.requests} requests, ${bytesText(traffic.bytes)}`,
  ].join("\n");
}
