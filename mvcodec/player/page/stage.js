// The picture: draws it, and turns dragging and the wheel into moves.

const WHEEL_PX = 60; // of a wheel's notch, or of a finger's way on a touchpad

export class Stage {
  // `moved(rows, cols)`: by how many spans of the array; `turned(frames)`: by the wheel.
  constructor(element, { moved, turned }) {
    this.element = element;
    this.canvas = element.querySelector("canvas");
    this.context = this.canvas.getContext("2d", { alpha: false });
    this.last = null;
    this.wheel = 0;
    element.addEventListener("pointerdown", (event) => this.grab(event));
    element.addEventListener("pointermove", (event) => this.drag(event, moved));
    for (const end of ["pointerup", "pointercancel"]) element.addEventListener(end, (event) => this.release(event));
    element.addEventListener("wheel", (event) => this.turn(event, turned), { passive: false });
  }

  async draw(blob) {
    const bitmap = await createImageBitmap(blob);
    const { canvas } = this;
    if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) {
      canvas.width = bitmap.width;
      canvas.height = bitmap.height;
    }
    this.context.drawImage(bitmap, 0, 0);
    bitmap.close();
  }

  grab(event) {
    if (event.button !== 0 || this.last) return;
    this.last = { id: event.pointerId, x: event.clientX, y: event.clientY };
    this.element.setPointerCapture(event.pointerId);
    this.element.classList.add("dragging");
  }

  drag(event, moved) {
    const last = this.last;
    if (!last || event.pointerId !== last.id) return;
    const { width, height } = this.shown();
    // The scene follows the finger: the viewpoint goes the other way.
    moved((last.y - event.clientY) / height, (last.x - event.clientX) / width);
    last.x = event.clientX;
    last.y = event.clientY;
  }

  release(event) {
    if (!this.last || event.pointerId !== this.last.id) return;
    this.last = null;
    this.element.classList.remove("dragging");
  }

  turn(event, turned) {
    if (event.ctrlKey) return; // the browser's zoom
    event.preventDefault();
    const px = event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? event.deltaY : event.deltaY * WHEEL_PX;
    if (Math.sign(px) !== Math.sign(this.wheel)) this.wheel = 0;
    this.wheel += px;
    const frames = Math.trunc(this.wheel / WHEEL_PX);
    this.wheel -= frames * WHEEL_PX;
    if (frames) turned(frames);
  }

  // The size of the picture in the window, px.
  shown() {
    const box = this.element.getBoundingClientRect();
    const scale = Math.min(box.width / this.canvas.width, box.height / this.canvas.height);
    return { width: this.canvas.width * scale, height: this.canvas.height * scale };
  }
}
