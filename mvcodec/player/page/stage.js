// The picture: draws it, and turns dragging, hovering, the wheel and two fingers into moves.

const STILL_PX = 5; // a pointer that moved less was not dragged
const DOUBLE_MS = 280;
const WHEEL = 1 / 1200; // what the wheel's pixels are worth
const PINCH = 0.5; // and the logarithm of a pinch

export class Stage {
  // `moved(rows, cols)`: by how many spans of the array; `ahead(by)`: a share of the farthest; `hovered(at)`: in shares of the
  // picture from its upper left, null where the pointer left it; `clicked` comes after it is known to be no double click.
  constructor(element, handlers) {
    this.element = element;
    this.handlers = handlers;
    this.canvas = element.querySelector("canvas");
    this.context = this.canvas.getContext("2d", { alpha: false });
    this.pointers = new Map();
    this.start = null;
    this.click = null;
    element.addEventListener("pointerdown", (event) => {
      handlers.touched();
      this.grab(event);
    });
    element.addEventListener("pointermove", (event) => this.move(event));
    element.addEventListener("pointerup", (event) => this.release(event) && this.count());
    element.addEventListener("pointercancel", (event) => this.release(event));
    element.addEventListener("pointerleave", () => handlers.hovered(null));
    element.addEventListener("wheel", (event) => {
      event.preventDefault();
      handlers.touched();
      handlers.ahead(-event.deltaY * WHEEL);
    }, { passive: false });
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
    if (event.button !== 0) return;
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    this.element.setPointerCapture(event.pointerId);
    this.element.classList.add("dragging");
    this.dragged = this.pointers.size > 1;
    if (!this.dragged) this.start = { x: event.clientX, y: event.clientY };
  }

  move(event) {
    const { handlers, pointers } = this;
    const last = pointers.get(event.pointerId);
    if (!last) {
      handlers.hovered(this.placeOf(event));
      return;
    }
    const spread = this.spread();
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (pointers.size > 1) {
      if (spread > 0) handlers.ahead(PINCH * Math.log(this.spread() / spread));
      return;
    }
    this.dragged ||= Math.hypot(event.clientX - this.start.x, event.clientY - this.start.y) > STILL_PX;
    if (!this.dragged) {
      pointers.set(event.pointerId, last);
      return;
    }
    const { width, height } = this.shown();
    // The scene follows the finger: the viewpoint goes the other way.
    handlers.moved((last.y - event.clientY) / height, (last.x - event.clientX) / width);
  }

  // True where the pointer was not dragged.
  release(event) {
    if (!this.pointers.delete(event.pointerId)) return false;
    if (this.pointers.size === 0) this.element.classList.remove("dragging");
    return !this.dragged;
  }

  count() {
    if (this.click !== null) {
      clearTimeout(this.click);
      this.click = null;
      this.handlers.doubleClicked();
      return;
    }
    this.click = setTimeout(() => {
      this.click = null;
      this.handlers.clicked();
    }, DOUBLE_MS);
  }

  // Distance of two fingers, px.
  spread() {
    const [one, other] = [...this.pointers.values()];
    return one && other ? Math.hypot(one.x - other.x, one.y - other.y) : 0;
  }

  // In shares of the picture from its upper left.
  placeOf(event) {
    const box = this.element.getBoundingClientRect();
    const { width, height } = this.shown();
    return {
      x: 0.5 + (event.clientX - box.left - box.width / 2) / width,
      y: 0.5 + (event.clientY - box.top - box.height / 2) / height,
    };
  }

  // Where a place of the picture is in the window, px.
  windowPx({ x, y }) {
    const box = this.element.getBoundingClientRect();
    const { width, height } = this.shown();
    return { x: box.left + box.width / 2 + (x - 0.5) * width, y: box.top + box.height / 2 + (y - 0.5) * height };
  }

  // The size of the picture in the window, px.
  shown() {
    const box = this.element.getBoundingClientRect();
    const scale = Math.min(box.width / this.canvas.width, box.height / this.canvas.height);
    return { width: this.canvas.width * scale, height: this.canvas.height * scale };
  }
}
