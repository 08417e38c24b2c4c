/** Every text that people see, in one place; short. */

export const TEXTS = {
  stage: "Picture. Drag, or use the arrow keys, to look around",
  waitingFile: "Opening the file",
  waitingPicture: "Decoding",
  hint: "Drag to look around",
  play: "Play",
  pause: "Pause",
  back: "One frame back",
  on: "One frame on",
  timeline: "Time",
  speed: "Speed",
  show: "Show",
  more: "More",
  fullscreen: "Full screen",
  help: "Keys",
  close: "Close",
  dismiss: "Dismiss",
  savePicture: "Save picture",
  saveClip: "Save clip",
  copyLink: "Copy link",
  linkCopied: "Link copied",
  openFile: "Open a file",
  recording: "Recording until the end of the loop",
  live: "live",
  noFile: "Drop an .mcap file here, or open one",
  noMaps: "This file has no disparity maps: the nearest camera is shown",
  predicted: (count: number) =>
    `${count} of this file's cameras are coded from the others, which browsers cannot decode: the nearest of the other cameras is shown. ` +
    "mvcodec play --renderer server shows all views",
  noWebCodecs:
    "This page may not decode video here: browsers allow it on https:// and on this machine only. Try mvcodec play --renderer server",
  disparity: (px: number, metres: number | undefined) =>
    metres === undefined ? `${px.toFixed(1)} px` : `${px.toFixed(1)} px, ${metres.toFixed(2)} m`,
  looks: {
    picture: "Picture",
    disparity: "Disparity",
    layers: "Layers",
    provenance: "Cameras that see it",
    disagreement: "Disagreement of the cameras",
  },
  eyes: { one: "One view", "side by side": "Side by side", anaglyph: "Red-cyan" },
  views: "Eyes",
  wipe: "Compare with the picture",
  focus: "Focus",
  everythingSharp: "everything",
} as const;

/** Key -> what it does, for the list of keys. */
export const KEYS: readonly (readonly [string, string])[] = [
  ["Space k", "play, pause"],
  ["← → ↑ ↓", "look around"],
  [", .", "one frame back, on"],
  ["j l", "some seconds back, on"],
  ["Home End", "first frame, last frame"],
  ["+ -", "faster, slower"],
  ["a b", "loop from here, to here; again: off"],
  ["v", "what is shown"],
  ["e", "one view, side by side, red-cyan"],
  ["w s", "move ahead, back"],
  ["h", "follow the pointer, or not"],
  ["p", "save the picture"],
  ["c", "copy a link to this view and time"],
  ["o", "open a file"],
  ["f", "full screen"],
  ["i", "statistics"],
  ["?", "this list"],
];
