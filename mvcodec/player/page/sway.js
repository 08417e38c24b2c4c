// A gentle sway that shows that the picture has depth, until somebody touches the player.

const REACH = 0.16; // share of the array's width and height that it sways over, to each side
const PERIOD_S = 7;
const EVERY_MS = 66; // each step is a picture that the server makes

export class Sway {
  // `move(row, col)` looks from there.
  constructor(move) {
    this.move = move;
    this.timer = null;
  }

  get isOn() {
    return this.timer !== null;
  }

  begin({ rows, cols }) {
    const since = performance.now();
    this.end();
    this.timer = setInterval(() => {
      if (document.hidden) return;
      const turn = (2 * Math.PI * (performance.now() - since)) / (1000 * PERIOD_S);
      const down = cols > 1 ? (1 - Math.cos(turn)) / 2 : Math.sin(turn);
      this.move((rows - 1) * (0.5 + REACH * down), (cols - 1) * (0.5 + REACH * Math.sin(turn)));
    }, EVERY_MS);
  }

  end() {
    clearInterval(this.timer);
    this.timer = null;
  }
}
