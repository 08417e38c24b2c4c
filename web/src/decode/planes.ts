/** A decoded picture's planes, taken out of the decoder's frame so that it can be closed at once. */

/** 4:2:0, 8 bits, cropped to the stream's own visible size. */
export interface Planes {
  readonly width: number;
  readonly height: number;
  readonly y: Uint8Array;
  /** Half the size each way, rounded up. */
  readonly u: Uint8Array;
  readonly v: Uint8Array;
}

export function planeBytes(planes: Planes): number {
  return planes.y.length + planes.u.length + planes.v.length;
}

/** Copy a frame's planes and close it. Throws Error for a format that is not 8-bit 4:2:0. */
export async function takePlanes(frame: VideoFrame): Promise<Planes> {
  try {
    const rect = frame.visibleRect;
    const format = frame.format;
    if (rect === null || (format !== "I420" && format !== "NV12")) {
      throw new Error(`a decoder that gives ${format}, not I420 or NV12`);
    }
    const { width, height } = rect;
    const [halfWidth, halfHeight] = [(width + 1) >> 1, (height + 1) >> 1];
    const [luma, chroma] = [width * height, halfWidth * halfHeight];
    const bytes = new Uint8Array(luma + 2 * chroma);
    const layout: PlaneLayout[] = [{ offset: 0, stride: width }];
    if (format === "I420") {
      layout.push({ offset: luma, stride: halfWidth }, { offset: luma + chroma, stride: halfWidth });
    } else {
      layout.push({ offset: luma, stride: 2 * halfWidth });
    }
    await frame.copyTo(bytes, { rect, layout });
    const y = bytes.subarray(0, luma);
    if (format === "I420") return { width, height, y, u: bytes.subarray(luma, luma + chroma), v: bytes.subarray(luma + chroma) };
    return { width, height, y, ...apart(bytes.subarray(luma)) };
  } finally {
    frame.close();
  }
}

/** Pairs of chroma samples -> two planes. */
function apart(pairs: Uint8Array): { u: Uint8Array; v: Uint8Array } {
  const u = new Uint8Array(pairs.length / 2);
  const v = new Uint8Array(pairs.length / 2);
  for (let i = 0; i < u.length; i++) {
    u[i] = pairs[2 * i];
    v[i] = pairs[2 * i + 1];
  }
  return { u, v };
}

/** A small RGB picture of planes (BT.709, limited range), by taking every so many-th pixel. */
export function smallPicture(planes: Planes, width: number): ImageData {
  const step = planes.width / Math.min(width, planes.width);
  const [columns, rows] = [Math.floor(planes.width / step), Math.max(Math.floor(planes.height / step), 1)];
  const out = new ImageData(columns, rows);
  const half = (planes.width + 1) >> 1;
  for (let j = 0; j < rows; j++) {
    for (let i = 0; i < columns; i++) {
      const [x, y] = [Math.floor(i * step), Math.floor(j * step)];
      const chroma = (y >> 1) * half + (x >> 1);
      const luma = (255 / 219) * (planes.y[y * planes.width + x] - 16);
      const cb = (255 / 224) * (planes.u[chroma] - 128);
      const cr = (255 / 224) * (planes.v[chroma] - 128);
      out.data.set([luma + 1.5748 * cr, luma - 0.1873 * cb - 0.4681 * cr, luma + 1.8556 * cb, 255], 4 * (j * columns + i));
    }
  }
  return out;
}
