/** What a view shows. */

/** In the order of `view.frag.glsl`. */
export const LOOKS = ["picture", "disparity", "layers", "provenance", "disagreement", "difference"] as const;
export type Look = (typeof LOOKS)[number];
