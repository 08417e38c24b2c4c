/** What the colours of a look mean, and how good a view is beside its original. */

import { element } from "./dom.ts";
import type { Engine } from "./engine.ts";
import { TEXTS } from "./texts.ts";

export class Legend {
  readonly box = element("p", { class: "legend", role: "status", hidden: true });

  show({ shown, psnr }: Engine): void {
    const text = [TEXTS.legends[shown.look], psnr === undefined ? "" : TEXTS.psnr(psnr)].filter(Boolean).join(". ");
    this.box.hidden = text === "";
    if (this.box.textContent !== text) this.box.textContent = text; // it is read aloud when it changes
  }
}
