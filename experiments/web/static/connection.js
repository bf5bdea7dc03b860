// The WebSocket: connects again after a failure, and numbers inputs and sends them until they are taken.

const HEAD = 28; // bytes before the picture of a frame; docs/protocol.md
const CODECS = { 1: "jpeg", 2: "h264" };
const BATCH = 64; // inputs of one message
const FIRST_WAIT = 250; // ms before the first new try
const LONGEST_WAIT = 500; // ms; a server that was started again is there within a second
const FINAL = new Set([4000, 4001, 4002, 4003]); // codes after which the page does not connect by itself

export class Connection {
  #socket = null;
  #wait = FIRST_WAIT;
  #waiting = []; // inputs that are not taken yet
  #next = 1;
  #ready = false;
  #hello;
  #on;

  /**
   * @param {() => object} hello gives the first message
   * @param {(message: object) => void} on takes messages; frames have the type "frame"
   */
  constructor(hello, on) {
    this.#hello = hello;
    this.#on = on;
  }

  open() {
    const socket = new WebSocket(location.href.replace(/^http/, "ws").replace(/[?#].*$/, ""));
    socket.binaryType = "arraybuffer";
    this.#socket = socket;
    socket.onopen = () => socket.send(JSON.stringify(this.#hello()));
    socket.onmessage = ({ data }) => {
      if (socket === this.#socket) this.#take(data);
    };
    socket.onclose = ({ code }) => {
      if (socket === this.#socket) this.#closed(code);
    };
  }

  /** Sends a message; it is lost if there is no connection. */
  send(message) {
    if (this.#socket?.readyState === WebSocket.OPEN) this.#socket.send(JSON.stringify(message));
  }

  /** Sends an input, again and again until it is taken. */
  input(values) {
    const input = { number: this.#next++, ...values };
    this.#waiting.push(input);
    if (this.#ready) this.send({ type: "inputs", inputs: [input] });
    return input.number;
  }

  /** Inputs that are not safe yet. */
  get pending() {
    return this.#waiting.length;
  }

  /** Closes the connection for good. */
  close() {
    const socket = this.#socket;
    this.#socket = null;
    socket?.close(1000);
  }

  #take(data) {
    this.#wait = FIRST_WAIT;
    const message = typeof data === "string" ? JSON.parse(data) : readFrame(data);
    if (message.type === "ready") {
      this.#ready = message.begun;
      this.#waiting = this.#waiting.filter((input) => input.number > message.input);
      this.#next = Math.max(this.#next, message.input + 1);
      if (this.#ready) this.resend();
    } else if (message.type === "taken") {
      this.#waiting = this.#waiting.filter((input) => input.number > message.input);
    } else if (message.type === "recovering") {
      this.#ready = false;
    }
    this.#on(message);
  }

  /** Sends all that is not taken. */
  resend() {
    this.#ready = true;
    for (let i = 0; i < this.#waiting.length; i += BATCH) {
      this.send({ type: "inputs", inputs: this.#waiting.slice(i, i + BATCH) });
    }
  }

  #closed(code) {
    this.#ready = false;
    const final = FINAL.has(code);
    this.#on({ type: "closed", code, final });
    if (final) return;
    setTimeout(() => this.#socket && this.open(), this.#wait * (0.75 + 0.5 * Math.random()));
    this.#wait = Math.min(2 * this.#wait, LONGEST_WAIT);
  }
}

function readFrame(buffer) {
  const head = new DataView(buffer, 0, HEAD);
  return {
    type: "frame",
    codec: CODECS[head.getUint8(1)],
    key: (head.getUint8(2) & 1) === 1,
    width: head.getUint16(4, true),
    height: head.getUint16(6, true),
    number: head.getUint32(8, true),
    step: head.getUint32(12, true),
    input: Number(head.getBigUint64(16, true)),
    milliseconds: head.getFloat32(24, true),
    data: new Uint8Array(buffer, HEAD),
  };
}
