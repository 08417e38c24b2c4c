/** Where one camera's brightness is read for a run of pixels of one sample, and how much its pixels count, in whole numbers. */
export class DraftFetch {
  /** Of its four pixels the upper left one, and what each counts. */
  place = 0;
  a = 0;
  b = 0;
  c = 0;
  d = 0;
  /** The nearest pixel, between pixels of its row; and what it counts where it is alone. */
  nearest = 0;
  all = 0;

  /** `u`, `v`: where the first pixel is seen; `gain`: what all four count together. */
  aim(u: number, v: number, lastX: number, lastY: number, stride: number, gain: number): void {
    const inX = Math.max(Math.min(u, lastX), 0);
    const inY = Math.max(Math.min(v, lastY), 0);
    const left = inX | 0;
    const top = inY | 0;
    const across = inX - left;
    const down = inY - top;
    this.place = top * stride + left;
    this.all = gain | 0;
    this.d = (gain * across * down) | 0;
    this.c = ((gain * down) | 0) - this.d;
    this.b = ((gain * across) | 0) - this.d;
    this.a = this.all - this.b - this.c - this.d;
    this.nearest = ((inY + 0.5) | 0) * stride + inX + 0.5;
  }
}
