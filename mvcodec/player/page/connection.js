// The WebSocket: opens again by itself, and takes a picture's message apart.

const FIRST_WAIT_MS = 400;
const LONGEST_WAIT_MS = 5000;
const BUSY = 1013;
const REFUSED = 1008;

export class Connection {
  // `handlers`: hello(facts), state(state), trouble(facts), picture(facts, blob), away(reason), all called with plain values.
  constructor(handlers) {
    this.handlers = handlers;
    this.waitMs = FIRST_WAIT_MS;
    this.socket = null;
    this.open();
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/view`);
    socket.binaryType = "arraybuffer";
    socket.onmessage = (event) => this.receive(event.data);
    socket.onclose = (event) => this.closed(event);
    this.socket = socket;
  }

  // Messages are small and rare; one that cannot go now is out of date when it could.
  send(type, fields = {}) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ type, ...fields }));
  }

  receive(data) {
    if (typeof data === "string") {
      const message = JSON.parse(data);
      if (message.type === "hello") this.waitMs = FIRST_WAIT_MS;
      this.handlers[message.type](message);
      return;
    }
    const length = new DataView(data).getUint32(0);
    const facts = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    const blob = new Blob([new Uint8Array(data, 4 + length)], { type: "image/jpeg" });
    this.handlers.picture(facts, blob, data.byteLength);
  }

  closed(event) {
    const reasons = { [BUSY]: event.reason, [REFUSED]: `The server refused: ${event.reason}` };
    this.handlers.away(reasons[event.code] || "The server is gone.");
    setTimeout(() => this.open(), this.waitMs);
    this.waitMs = Math.min(2 * this.waitMs, LONGEST_WAIT_MS);
  }
}
