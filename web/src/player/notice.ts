/** What the player has to say, until it is dismissed. */

import { button, element } from "./dom.ts";
import { TEXTS } from "./texts.ts";

export class Notice {
  readonly box = element("div", { class: "notice", role: "alert", hidden: true });

  /** Say something, with buttons for what can be done about it. */
  tell(text: string, ...actions: HTMLButtonElement[]): void {
    const close = button(TEXTS.dismiss, "×", () => this.hide());
    close.classList.add("close");
    this.box.replaceChildren(element("p", {}, text), ...actions, close);
    this.box.hidden = false;
  }

  hide(): void {
    this.box.hidden = true;
  }
}
