/** Elements without HTML text: what comes from a file can never become markup. */

type Attributes = Record<string, string | boolean>;

export function element<K extends keyof HTMLElementTagNameMap>(
  name: K, attributes: Attributes = {}, ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (typeof value === "string") made.setAttribute(key, value);
    else made.toggleAttribute(key, value);
  }
  made.append(...children);
  return made;
}

/** Shapes of the buttons, as paths in 16 x 16. */
const ICONS = {
  play: "M5 3v10l8-5z",
  pause: "M5 3v10M11 3v10",
  back: "M4 3v10M12 3 7 8l5 5",
  on: "M12 3v10M4 3l5 5-5 5",
  fullscreen: "M2 6V2h4M10 2h4v4M14 10v4h-4M6 14H2v-4",
  more: "M3 8h.01M8 8h.01M13 8h.01",
} as const;

export function icon(name: keyof typeof ICONS): SVGElement {
  return drawing("svg", { viewBox: "0 0 16 16", "aria-hidden": "true" }, drawing("path", { d: ICONS[name] }));
}

/** An element of SVG; colours go in as attributes, since pages may allow no inline styles. */
export function drawing(name: string, attributes: Record<string, string> = {}, ...children: Node[]): SVGElement {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

export function button(label: string, content: Node | string, onClick: () => void): HTMLButtonElement {
  const made = element("button", { type: "button", title: label, "aria-label": label }, content);
  made.addEventListener("click", onClick);
  return made;
}

export function options(select: HTMLSelectElement, choices: readonly (readonly [value: string, text: string])[]): void {
  select.replaceChildren(...choices.map(([value, text]) => element("option", { value }, text)));
}
