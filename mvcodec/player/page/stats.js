// For those who want to know: which picture it is, pictures drawn in the last second, and what the last ones cost.

const WINDOW_MS = 1000;
const LAST = 8;
const DIGITS = 2;

// Numbers keep their width, so that the line stands still while they change.
const padded = (text) => text.padStart(DIGITS, "\u2007");

export class Stats {
  constructor(element) {
    this.element = element;
    this.drawn = [];
    this.recent = [];
    this.facts = null;
    setInterval(() => this.write(), 250);
  }

  note(facts) {
    this.drawn.push(performance.now());
    this.recent.push(facts);
    if (this.recent.length > LAST) this.recent.shift();
    const first = this.facts === null;
    this.facts = facts;
    if (first) this.write(); // the others wait for the clock, so that the line can be read
  }

  get fps() {
    const now = performance.now();
    this.drawn = this.drawn.filter((time) => now - time <= WINDOW_MS);
    return this.drawn.length;
  }

  write() {
    if (!this.facts) return;
    const ms = (name) => {
      const values = this.recent.map((facts) => facts[name]).filter((value) => typeof value === "number");
      return padded(values.length ? String(Math.round(values.reduce((sum, value) => sum + value, 0) / values.length)) : "–");
    };
    const { frame, index, time_s, row, col, damage } = this.facts;
    const other = index !== frame && !damage ? `, ${index} of the input` : "";
    const parts = [
      `frame ${frame} (from 0)${other}`,
      `${time_s.toFixed(3)} s`,
      `view ${row.toFixed(2)}, ${col.toFixed(2)}`,
      `${padded(String(this.fps || "–"))} fps`,
      `decode ${ms("decode_ms")} ms`,
      `synthesis ${ms("synthesis_ms")} ms`,
      `encode ${ms("encode_ms")} ms`,
      `transfer ${ms("transfer_ms")} ms`,
      `dropped ${this.facts.dropped}`,
    ];
    if (this.facts.enhanced) parts.push("enhanced");
    if (this.facts.quick) parts.push("draft");
    if (this.facts.scale < 1) parts.push(`at ${Math.round(100 * this.facts.scale)} % size`);
    const spans = parts.map((text) => Object.assign(document.createElement("span"), { textContent: text }));
    this.element.replaceChildren(...spans);
  }
}
