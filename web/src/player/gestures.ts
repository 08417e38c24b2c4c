/** Hands on the picture: drag, hover, wheel, pinch. All in shares of the picture. */

export interface GestureEvents {
  /** Somebody touches the player for the first time, or again. */
  onTouch(): void;
  /** The picture is held by a pointer, or let go. */
  onHold(isHeld: boolean): void;
  /** The view was dragged by so much of the picture's width and height. */
  onDrag(across: number, down: number): void;
  /** The pointer hovers there, from the picture's upper left; undefined: it left. */
  onHover(at: { x: number; y: number } | undefined): void;
  /** Ahead, or back where negative. */
  onDolly(by: number): void;
  /** `isFinger`: or else a mouse or a pen. */
  onClick(isFinger: boolean): void;
  onDoubleClick(): void;
}

/** A pointer that moved less was not dragged, px. */
const STILL_PX = 5;
const DOUBLE_MS = 280;
/** What the wheel's pixels, and the logarithm of a pinch, are worth. */
const WHEEL = 1 / 1200;
const PINCH = 0.5;

interface Place {
  x: number;
  y: number;
}

export class Gestures {
  readonly #stage: HTMLElement;
  readonly #events: GestureEvents;
  readonly #pointers = new Map<number, Place>();
  #start: Place | undefined;
  #isDragged = false;
  #clicked: ReturnType<typeof setTimeout> | undefined;
  readonly #stop = new AbortController();

  constructor(stage: HTMLElement, events: GestureEvents) {
    this.#stage = stage;
    this.#events = events;
    const { signal } = this.#stop;
    stage.addEventListener("pointerdown", (event) => this.#down(event), { signal });
    stage.addEventListener("pointermove", (event) => this.#move(event), { signal });
    for (const name of ["pointerup", "pointercancel"] as const) stage.addEventListener(name, (event) => this.#up(event), { signal });
    stage.addEventListener("pointerleave", () => events.onHover(undefined), { signal });
    stage.addEventListener("wheel", (event) => {
      event.preventDefault();
      events.onTouch();
      events.onDolly(-event.deltaY * WHEEL);
    }, { passive: false, signal });
  }

  close(): void {
    this.#stop.abort();
    clearTimeout(this.#clicked);
  }

  #down(event: PointerEvent): void {
    this.#events.onTouch();
    this.#pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    this.#events.onHold(true);
    this.#stage.setPointerCapture(event.pointerId);
    if (this.#pointers.size > 1) {
      this.#isDragged = true;
      return;
    }
    this.#start = { x: event.clientX, y: event.clientY };
    this.#isDragged = false;
  }

  #move(event: PointerEvent): void {
    const box = this.#stage.getBoundingClientRect();
    const last = this.#pointers.get(event.pointerId);
    if (last === undefined) {
      this.#events.onHover({ x: (event.clientX - box.left) / box.width, y: (event.clientY - box.top) / box.height });
      return;
    }
    const now = { x: event.clientX, y: event.clientY };
    const before = this.#spread();
    this.#pointers.set(event.pointerId, now);
    if (this.#pointers.size > 1) {
      if (before > 0) this.#events.onDolly(PINCH * Math.log(this.#spread() / before));
      return;
    }
    this.#isDragged ||= Math.hypot(now.x - this.#start!.x, now.y - this.#start!.y) > STILL_PX;
    if (!this.#isDragged) return;
    this.#stage.classList.add("dragging");
    this.#events.onDrag((now.x - last.x) / box.width, (now.y - last.y) / box.height);
  }

  #up(event: PointerEvent): void {
    if (!this.#pointers.delete(event.pointerId)) return;
    this.#stage.classList.remove("dragging");
    if (this.#pointers.size === 0) this.#events.onHold(false);
    if (this.#isDragged || event.type === "pointercancel" || event.button !== 0) return;
    // A second click soon after means full screen, and the first one nothing.
    if (this.#clicked === undefined) {
      this.#clicked = setTimeout(() => {
        this.#clicked = undefined;
        this.#events.onClick(event.pointerType === "touch");
      }, DOUBLE_MS);
    } else {
      clearTimeout(this.#clicked);
      this.#clicked = undefined;
      this.#events.onDoubleClick();
    }
  }

  /** Distance of two fingers, px. */
  #spread(): number {
    const [one, other] = [...this.#pointers.values()];
    return one && other ? Math.hypot(one.x - other.x, one.y - other.y) : 0;
  }
}
