// `?debug`: round trip from an input to the frame that shows it, frames a second, size, codec.

/** @import { Frame } from "./protocol.js" */

const SHOWN = 500; // ms between two updates

export class Debug {
  #element;
  /** @type {Map<number, number>} */
  #times = new Map(); // number of an input -> when it was sent, ms
  /** @type {number[]} */
  #trips = [];
  /** @type {number[]} */
  #frames = [];
  #bytes = 0;
  #at = 0;

  /** @param {HTMLElement} element @param {boolean} on */
  constructor(element, on) {
    this.#element = element;
    element.hidden = !on;
  }

  /** @param {number} number of an input */
  sent(number) {
    if (!this.#element.hidden) this.#times.set(number, performance.now());
  }

  /** @param {Frame} frame @param {number} pending inputs */
  shown(frame, pending) {
    if (this.#element.hidden) return;
    const now = performance.now();
    for (const [number, time] of this.#times) {
      if (number > frame.input) continue;
      this.#trips.push(now - time);
      this.#times.delete(number);
    }
    this.#frames.push(now);
    this.#bytes += frame.data.length;
    if (now - this.#at < SHOWN) return;
    const rate = (1000 * this.#frames.length) / Math.max(1, now - this.#at);
    const kilobits = (8 * this.#bytes) / Math.max(1, now - this.#at);
    const trips = this.#trips.sort((a, b) => a - b);
    const trip = trips.length ? `${trips[trips.length >> 1]?.toFixed(0)} ms` : "no input";
    this.#element.textContent = `round trip ${trip} · ${rate.toFixed(0)} fps · ${kilobits.toFixed(0)} kbit/s · ${frame.width}x${frame.height} ${frame.codec} · drawn in ${frame.milliseconds.toFixed(0)} ms · ${pending} not taken`;
    this.#trips = [];
    this.#frames = [];
    this.#bytes = 0;
    this.#at = now;
  }
}
