// The WebSocket: reconnects after a failure, numbers inputs, and repeats them until they are acknowledged.

/** @import { Link } from "./page_state.js" */
/** @import { FrameMessage, FromBrowser, Input, ToBrowser } from "./protocol.js" */

import { CODECS, FRAME_HEAD_BYTES, IDLE, KEY_FLAG, MAX_INPUTS, MAX_SILENCE, REFUSED, REPLACED, TOO_MUCH } from "./protocol.js";

const FIRST_WAIT = 250; // delay before reconnecting, in ms
const MAX_WAIT = 5000; // longest delay before reconnecting, in ms
const FIRST_PATIENCE = 5000; // silence after which a connection is replaced, in ms
const MAX_PATIENCE = 40_000; // the same after several replacements without a message, in ms
/** @type {Record<number, Link>} links after close codes after which the page does not reconnect automatically */
const FINAL = { [REFUSED]: "closed", [REPLACED]: "replaced", [IDLE]: "idle", [TOO_MUCH]: "closed" };

/** @typedef {{ type: "closed" } | { type: "silent" }} LinkLost The connection was closed, or is silent but open. */
/** @typedef {ToBrowser | FrameMessage | LinkLost} Received */

export class Connection {
  /** @type {Link} */
  link = "opening";
  /** @type {WebSocket | null} */
  #socket = null;
  #wait = FIRST_WAIT;
  #patience = FIRST_PATIENCE;
  /** @type {Input[]} */
  #waiting = []; // unacknowledged inputs
  /** @type {Input[]} */
  #unsent = []; // inputs of the current control step
  #next = 1;
  #open = false; // true while the session accepts inputs
  #heard = performance.now();
  #hello;
  #on;

  /**
   * @param {() => FromBrowser} hello returns the first message
   * @param {(message: Received) => void} on handles messages
   */
  constructor(hello, on) {
    this.#hello = hello;
    this.#on = on;
  }

  open() {
    this.#heard = performance.now();
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

  /**
   * Sends a message, or drops it without a connection.
   * @param {FromBrowser} message
   */
  send(message) {
    if (this.#socket?.readyState === WebSocket.OPEN) this.#socket.send(JSON.stringify(message));
  }

  /**
   * Sends an input, repeatedly until acknowledged. Inputs of one control step are sent together.
   * @param {Omit<Input, "number">} values
   * @returns {Input}
   */
  input(values) {
    const input = { number: this.#next++, ...values };
    this.#waiting.push(input);
    if (typeof values.step === "number") this.#unsent.push(input);
    else if (this.#open) this.send({ type: "inputs", inputs: [input] });
    return input;
  }

  /** Sends all inputs of control steps before `until`, and promises that there are no more. @param {number} until */
  flush(until) {
    if (!this.#open) return;
    this.send({ type: "inputs", inputs: this.#unsent.splice(0, MAX_INPUTS), until });
  }

  /** Number of unacknowledged inputs. */
  get pending() {
    return this.#waiting.length;
  }

  /**
   * Replaces a connection that has been silent for too long, as after a change of network. Call it regularly.
   * @param {boolean} strict true if the clock runs, so that a shorter silence counts as a lost link
   */
  watch(strict) {
    if (!this.#socket || (this.link !== "open" && this.link !== "opening" && this.link !== "lost")) return;
    const silence = performance.now() - this.#heard;
    if (strict && this.link === "open" && silence > 1000 * MAX_SILENCE) {
      this.link = "lost";
      this.#on({ type: "silent" });
    }
    if (silence < this.#patience || this.#socket.readyState > WebSocket.OPEN) return;
    this.#patience = Math.min(2 * this.#patience, MAX_PATIENCE);
    const silent = this.#socket;
    this.#lose("lost");
    this.open();
    silent.close();
  }

  /** Closes the connection without reconnecting. */
  close() {
    const socket = this.#socket;
    this.#socket = null;
    socket?.close(1000);
  }

  /** @param {string | ArrayBuffer} data */
  #take(data) {
    [this.#wait, this.#patience] = [FIRST_WAIT, FIRST_PATIENCE];
    this.#heard = performance.now();
    /** @type {Received} */
    const message = typeof data === "string" ? JSON.parse(data) : readFrame(data);
    if (message.type === "occupied" || message.type === "replaced") this.link = message.type;
    else if (message.type === "error" && message.code === "idle") this.link = "idle";
    else if (this.link === "opening" || this.link === "lost" || message.type === "state") this.link = "open";
    if (message.type === "state") {
      this.#next = Math.max(this.#next, message.input + 1);
      const open = message.phase === "running" || message.phase === "paused";
      if (open && !this.#open) this.#repeat();
      this.#open = open;
    } else if (message.type === "taken") {
      this.#waiting = this.#waiting.filter((input) => input.number > message.input);
    }
    this.#on(message);
  }

  #repeat() {
    this.#unsent = [];
    for (let i = 0; i < this.#waiting.length; i += MAX_INPUTS) {
      this.send({ type: "inputs", inputs: this.#waiting.slice(i, i + MAX_INPUTS) });
    }
  }

  /** @param {number} code */
  #closed(code) {
    const final = this.link === "replaced" || this.link === "idle" ? this.link : FINAL[code];
    this.#lose(final ?? "lost");
    if (final) return;
    const closed = this.#socket;
    setTimeout(() => this.#socket === closed && this.open(), this.#wait * (0.75 + 0.5 * Math.random()));
    this.#wait = Math.min(2 * this.#wait, MAX_WAIT);
  }

  /** @param {Link} link that remains */
  #lose(link) {
    this.#open = false;
    this.link = link;
    this.#on({ type: "closed" });
  }
}

/**
 * @param {ArrayBuffer} buffer
 * @returns {FrameMessage}
 */
export function readFrame(buffer) {
  const head = new DataView(buffer, 0, FRAME_HEAD_BYTES);
  return {
    type: "frame",
    codec: CODECS[head.getUint8(1)] ?? "none",
    key: (head.getUint8(2) & KEY_FLAG) !== 0,
    width: head.getUint16(4, true),
    height: head.getUint16(6, true),
    number: head.getUint32(8, true),
    step: head.getUint32(12, true),
    input: Number(head.getBigUint64(16, true)),
    milliseconds: head.getFloat32(24, true),
    data: new Uint8Array(buffer, FRAME_HEAD_BYTES),
  };
}
