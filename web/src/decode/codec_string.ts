/** What WebCodecs calls a stream, from its first keyframe. */

import type { Codec } from "../container/header.ts";

const SPS = 7;

/** The codec string of a track whose keyframe this is, or undefined where the unit is none. */
export function codecString(codec: Codec, unit: Uint8Array): string | undefined {
  // The level says how much a decoder must be able to do; 5.1 is 4096 x 2304 at 30 pictures a second.
  switch (codec) {
    case "h264":
      return h264String(unit);
    case "hevc":
      return "hev1.1.6.L153.B0";
    case "av1":
      return "av01.0.13M.08";
    case "vp9":
      return "vp09.00.51.08";
  }
}

/** Profile, constraints and level are the three bytes behind the SPS's NAL unit header (ITU-T H.264, 7.3.2.1). */
function h264String(unit: Uint8Array): string | undefined {
  for (let i = 0; i + 6 < unit.length; i++) {
    if (unit[i] === 0 && unit[i + 1] === 0 && unit[i + 2] === 1 && (unit[i + 3] & 31) === SPS) {
      const digits = [...unit.subarray(i + 4, i + 7)].map((byte) => byte.toString(16).padStart(2, "0"));
      return `avc1.${digits.join("")}`;
    }
  }
  return undefined;
}
