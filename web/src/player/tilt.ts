/** A phone that is turned looks around. Some phones ask their owner first, on a tap. */

/** As Safari has it. */
interface Asking {
  requestPermission?: () => Promise<"granted" | "denied">;
}

interface Angles {
  readonly right: number;
  readonly down: number;
}

export class Tilt {
  readonly #onTurn: (right: number, down: number) => void;
  #home: Angles | undefined;

  /** `onTurn`: degrees to the right and down from where it was held first. */
  constructor(onTurn: (right: number, down: number) => void) {
    this.#onTurn = onTurn;
  }

  /** Whether this is something to hold in hands, of which nothing is heard before somebody has allowed it. */
  static get asksFirst(): boolean {
    const canAsk = "DeviceOrientationEvent" in globalThis && "requestPermission" in DeviceOrientationEvent;
    return canAsk && matchMedia("(pointer: coarse)").matches;
  }

  /** Ask whoever has just tapped; whether it is allowed. */
  static async ask(): Promise<boolean> {
    const { requestPermission } = DeviceOrientationEvent as Asking;
    return (await requestPermission?.().catch(() => "denied")) === "granted";
  }

  listen(signal: AbortSignal): void {
    addEventListener("deviceorientation", (event) => this.#turn(event), { signal });
    screen.orientation?.addEventListener("change", () => (this.#home = undefined), { signal });
  }

  #turn({ beta, gamma }: DeviceOrientationEvent): void {
    if (beta === null || gamma === null) return;
    const { right, down } = uprightAngles(beta, gamma, screen.orientation?.angle ?? 0);
    this.#home ??= { right, down };
    this.#onTurn(right - this.#home.right, down - this.#home.down);
  }
}

/** How far the screen is turned to the right and down, whichever of its sides is up; `angle`: that of the screen, degrees. */
export function uprightAngles(beta: number, gamma: number, angle: number): Angles {
  switch (angle) {
    case 90:
      return { right: beta, down: -gamma };
    case 180:
      return { right: -gamma, down: -beta };
    case 270:
      return { right: -beta, down: gamma };
    default:
      return { right: gamma, down: beta };
  }
}
