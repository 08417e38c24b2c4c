/** Where the viewer looks from: dragged, hovered, turned, by keys, or swaying until somebody touches the player. */

import type { Viewpoint } from "../geometry.ts";
import type { Engine } from "./engine.ts";
import { swayAt } from "./sway.ts";

/** Cells that a drag over the whole picture looks around. */
const DRAG_CELLS = 1.2;
/** Share of the array that hovering from edge to edge, or turning a phone by 45 degrees, looks around. */
const HOVER_SHARE = 0.3;
const TURN_DEGREES = 45;
/** Cells that a key looks around, and with shift. */
const KEY_CELLS = 0.125;
const FAR_KEY_CELLS = 1;

export class Looking {
  /** The pointer is followed without being pressed. */
  hovers = true;
  #engine: Engine | undefined;
  /** Where hovering and turning look around from. */
  #home: Viewpoint = { row: 0, col: 0 };
  #swaySince: number | undefined;

  /** Look at another file from where it is shown; `sways` until it is touched. */
  attach(engine: Engine, sways: boolean): void {
    this.#engine = engine;
    this.#home = engine.shown.view;
    this.hovers = engine.isLight;
    this.#swaySince = sways ? performance.now() : undefined;
    if (sways) requestAnimationFrame((now) => this.#sway(now));
  }

  endSway(): void {
    if (this.#swaySince !== undefined && this.#engine !== undefined) this.#home = this.#engine.shown.view;
    this.#swaySince = undefined;
  }

  /** The picture was dragged by shares of its size: what is under the pointer goes with it, the eye the other way. */
  drag(across: number, down: number): void {
    this.#move(-down * DRAG_CELLS, -across * DRAG_CELLS);
  }

  key(down: number, across: number, isFar: boolean): void {
    const cells = isFar ? FAR_KEY_CELLS : KEY_CELLS;
    this.#move(down * cells, across * cells);
  }

  go(view: Viewpoint): void {
    void this.#engine?.look(view);
    this.#home = this.#engine?.shown.view ?? view;
  }

  /** To the nearest place of the array. */
  goToNearest(): void {
    const view = this.#engine?.shown.view;
    if (view !== undefined) this.go({ row: Math.round(view.row), col: Math.round(view.col) });
  }

  /** The pointer hovers, by shares of the picture from its middle. */
  hover(right: number, down: number): void {
    if (this.hovers) this.#peer(right, down);
  }

  turn(right: number, down: number): void {
    this.#peer(right / TURN_DEGREES, down / TURN_DEGREES);
  }

  #move(down: number, across: number): void {
    const engine = this.#engine;
    if (engine === undefined) return;
    const { view } = engine.shown;
    const cell = (places: readonly number[]) => (places.length > 1 ? places[1] - places[0] : 0);
    const { realRows, realCols } = engine.header;
    this.go({ row: view.row + down * cell(realRows), col: view.col + across * cell(realCols) });
  }

  #peer(right: number, down: number): void {
    const engine = this.#engine;
    if (engine === undefined || this.#swaySince !== undefined) return;
    const { rows, cols } = engine.header;
    void engine.look({ row: this.#home.row + down * HOVER_SHARE * (rows - 1), col: this.#home.col + right * HOVER_SHARE * (cols - 1) });
  }

  #sway(now: number): void {
    const engine = this.#engine;
    if (this.#swaySince === undefined || engine === undefined || engine.isClosed) return;
    const { rows, cols } = engine.header;
    void engine.look(swayAt(rows, cols, Math.max(now - this.#swaySince, 0)));
    requestAnimationFrame((next) => this.#sway(next));
  }
}
