/** The player's module: defines `<mvcodec-player>`, and makes the page one where it says so. */

import { MvcodecPlayer } from "./player/element.ts";

export { FileDecoder } from "./decoder.ts";
export { MvcodecPlayer };

if (!customElements.get("mvcodec-player")) customElements.define("mvcodec-player", MvcodecPlayer);
