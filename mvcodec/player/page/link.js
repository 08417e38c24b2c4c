// The address: "#frame=12&view=0.5,1.25&look=disparity" leads back to the same picture.

const EVERY_MS = 300; // browsers bear only so many changes of the address

export function readLink() {
  const fields = new URLSearchParams(location.hash.slice(1));
  const found = {};
  const frame = Number.parseInt(fields.get("frame"), 10);
  if (Number.isFinite(frame)) found.frame = Math.max(0, frame);
  const view = (fields.get("view") || "").split(",").map(Number);
  if (fields.has("view") && view.length === 2 && view.every(Number.isFinite)) [found.row, found.col] = view;
  if (fields.has("look")) found.look = fields.get("look");
  const eyes = Number.parseFloat(fields.get("eyes"));
  if (Number.isFinite(eyes)) found.eyes = eyes;
  return found;
}

export class Link {
  constructor() {
    this.wanted = location.hash;
    this.timer = null;
  }

  write({ frame, row, col, look, eyes }, stereo) {
    let text = `#frame=${frame}&view=${short(row)},${short(col)}`;
    if (look !== "picture") text += `&look=${look}`;
    if (stereo) text += `&eyes=${short(eyes)}`;
    this.wanted = text;
    this.timer ??= setTimeout(() => {
      this.timer = null;
      if (location.hash !== this.wanted) history.replaceState(null, "", this.wanted);
    }, EVERY_MS);
  }
}

export function short(number) {
  return String(Math.round(1000 * number) / 1000);
}
