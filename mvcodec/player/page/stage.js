// The picture: draws it, and turns dragging into moves.

const STILL_PX = 5; // a pointer that moved less was not dragged
const DOUBLE_MS = 280;

export class Stage {
  // `moved(rows, cols)`: by how many spans of the array; `clicked` comes after it is known to be no double click.
  constructor(element, { touched, moved, clicked, doubleClicked }) {
    this.element = element;
    this.canvas = element.querySelector("canvas");
    this.context = this.canvas.getContext("2d", { alpha: false });
    this.last = null;
    this.start = null;
    this.click = null;
    element.addEventListener("pointerdown", (event) => {
      touched();
      this.grab(event);
    });
    element.addEventListener("pointermove", (event) => this.drag(event, moved));
    element.addEventListener("pointerup", (event) => this.release(event) && this.count(clicked, doubleClicked));
    element.addEventListener("pointercancel", (event) => this.release(event));
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
    this.start = this.last;
    this.dragged = false;
    this.element.setPointerCapture(event.pointerId);
    this.element.classList.add("dragging");
  }

  drag(event, moved) {
    const last = this.last;
    if (!last || event.pointerId !== last.id) return;
    this.dragged ||= Math.hypot(event.clientX - this.start.x, event.clientY - this.start.y) > STILL_PX;
    if (!this.dragged) return;
    const { width, height } = this.shown();
    // The scene follows the finger: the viewpoint goes the other way.
    moved((last.y - event.clientY) / height, (last.x - event.clientX) / width);
    this.last = { id: last.id, x: event.clientX, y: event.clientY };
  }

  // True where the pointer was not dragged.
  release(event) {
    if (!this.last || event.pointerId !== this.last.id) return false;
    this.last = null;
    this.element.classList.remove("dragging");
    return !this.dragged;
  }

  count(clicked, doubleClicked) {
    if (this.click !== null) {
      clearTimeout(this.click);
      this.click = null;
      doubleClicked();
      return;
    }
    this.click = setTimeout(() => {
      this.click = null;
      clicked();
    }, DOUBLE_MS);
  }

  // The size of the picture in the window, px.
  shown() {
    const box = this.element.getBoundingClientRect();
    const scale = Math.min(box.width / this.canvas.width, box.height / this.canvas.height);
    return { width: this.canvas.width * scale, height: this.canvas.height * scale };
  }
}
