// The small map of the array: real cameras, enhanced views, the viewpoint asked for (ring) and the one shown (dot).

const SVG = "http://www.w3.org/2000/svg";
const MOST_DOTS = 400;
const MARGIN = 0.14; // of the longer side

export class ArrayMap {
  constructor(svg, moveTo) {
    this.svg = svg;
    svg.addEventListener("pointerdown", (event) => {
      svg.setPointerCapture(event.pointerId);
      this.point(event, moveTo);
    });
    svg.addEventListener("pointermove", (event) => {
      if (svg.hasPointerCapture(event.pointerId)) this.point(event, moveTo);
    });
  }

  build({ rows, cols, real, enhanced }) {
    this.spans = [rows - 1, cols - 1];
    const longest = Math.max(rows - 1, cols - 1, 1);
    this.margin = MARGIN * longest;
    const width = cols - 1 + 2 * this.margin;
    const height = rows - 1 + 2 * this.margin;
    this.svg.setAttribute("viewBox", `${-this.margin} ${-this.margin} ${width} ${height}`);
    this.svg.style.setProperty("--across", width / Math.max(width, height));
    this.svg.style.setProperty("--down", height / Math.max(width, height));
    this.svg.replaceChildren();
    const unit = longest / 60;
    const box = this.margin / 2;
    this.add("rect", { class: "span", x: -box, y: -box, width: cols - 1 + 2 * box, height: rows - 1 + 2 * box, rx: 2 * unit });
    if (rows * cols <= MOST_DOTS) {
      for (let row = 0; row < rows; row++) for (let col = 0; col < cols; col++) this.add("circle", { class: "view", cx: col, cy: row, r: unit });
    }
    const side = 5 * unit;
    for (const [row, col] of enhanced) this.add("circle", { class: "enhanced", cx: col, cy: row, r: 2 * unit });
    for (const [row, col] of real) this.add("rect", { class: "real", x: col - side / 2, y: row - side / 2, width: side, height: side, rx: unit });
    this.aim = this.add("circle", { class: "aim", r: 4.5 * unit });
    this.here = this.add("circle", { class: "here", r: 2.6 * unit });
    this.svg.setAttribute("aria-valuemax", rows * cols - 1);
  }

  show({ row, col }, aim) {
    place(this.here, row, col);
    place(this.aim, aim.row, aim.col);
    this.svg.setAttribute("aria-valuetext", `row ${row.toFixed(2)}, column ${col.toFixed(2)}`);
    this.svg.setAttribute("aria-valuenow", Math.round(row * (this.spans[1] + 1) + col));
  }

  point(event, moveTo) {
    const box = this.svg.getBoundingClientRect();
    const [rows, cols] = this.spans;
    const at = (value, start, size, span) => ((value - start) / size) * (span + 2 * this.margin) - this.margin;
    moveTo(at(event.clientY, box.top, box.height, rows), at(event.clientX, box.left, box.width, cols));
  }

  add(name, attributes) {
    const element = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    this.svg.append(element);
    return element;
  }
}

function place(circle, row, col) {
  circle.setAttribute("cx", col);
  circle.setAttribute("cy", row);
}
