// What the colours of a look mean. Colours go in as SVG attributes: the page allows no inline styles.

const SVG = "http://www.w3.org/2000/svg";

export function drawLegend(box, legend) {
  box.hidden = !legend;
  if (!legend) {
    box.replaceChildren();
    return;
  }
  const parts = [element("p", legend.text)];
  if (legend.kind === "scale") parts.push(bar(legend.colours), ends(legend));
  if (legend.kind === "classes") parts.push(list(legend.items));
  box.replaceChildren(...parts);
}

function bar(colours) {
  const svg = drawing("svg", { class: "bar", viewBox: `0 0 ${colours.length - 1} 1`, preserveAspectRatio: "none", "aria-hidden": "true" });
  const gradient = drawing("linearGradient", { id: "scale" });
  colours.forEach((colour, i) => gradient.append(drawing("stop", { offset: i / (colours.length - 1), "stop-color": colour })));
  svg.append(gradient, drawing("rect", { width: colours.length - 1, height: 1, fill: "url(#scale)" }));
  return svg;
}

function ends({ low, high }) {
  const row = element("p", "");
  row.className = "ends";
  row.append(element("span", String(low)), element("span", String(high)));
  return row;
}

function list(items) {
  const ul = document.createElement("ul");
  for (const { colour, text, share } of items) {
    const li = document.createElement("li");
    const swatch = drawing("svg", { viewBox: "0 0 14 14", "aria-hidden": "true" });
    swatch.append(drawing("rect", { width: 14, height: 14, rx: 3, fill: colour }));
    li.append(swatch, element("span", text), element("span", `${(100 * share).toFixed(1)} %`));
    ul.append(li);
  }
  return ul;
}

function element(name, text) {
  const made = document.createElement(name);
  made.textContent = text;
  return made;
}

function drawing(name, attributes) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}
