// Display quality: frame rate, frame times, and latency from an input to the frame that shows it, or, if the browser
// draws, to the server's state with that input.

/** @import { FrameMessage } from "./protocol.js" */

export class Meter {
  /** @type {Map<number, number>} */
  #sent = new Map(); // input numbers -> sending times, in ms
  /** @type {number[]} */
  #trips = [];
  /** @type {number[]} */
  #gaps = [];
  #shown = 0; // frames
  #came = 0;
  #bytes = 0;
  #last = 0; // time of the last frame, in ms
  #start = performance.now();

  /** @param {number} number of an input */
  sent(number) {
    this.#sent.set(number, performance.now());
  }

  /** @param {FrameMessage} frame */
  came(frame) {
    this.#came++;
    this.#bytes += frame.data.length;
  }

  /** @param {FrameMessage} frame */
  shown(frame) {
    this.answered(frame.input);
    this.drawn();
  }

  /** Records that all inputs up to this number have taken effect. @param {number} input */
  answered(input) {
    const now = performance.now();
    for (const [number, time] of this.#sent) {
      if (number > input) continue;
      this.#trips.push(now - time);
      this.#sent.delete(number);
    }
  }

  /** Records a shown picture. */
  drawn() {
    const now = performance.now();
    if (this.#shown++) this.#gaps.push(now - this.#last);
    this.#last = now;
  }

  /** Returns the measurements since the last call. */
  take() {
    const now = performance.now();
    const seconds = Math.max(0.001, (now - this.#start) / 1000);
    const found = {
      seconds,
      frames_per_s: rounded(this.#shown / seconds),
      frame_ms: rounded(quantile(this.#gaps, 0.5) ?? 0),
      frame_ms_95: rounded(quantile(this.#gaps, 0.95) ?? 0),
      dropped: Math.max(0, this.#came - this.#shown),
      latency_ms: this.#trips.length ? rounded(quantile(this.#trips, 0.5) ?? 0) : null,
      kilobits: rounded((8 * this.#bytes) / 1000 / seconds),
    };
    [this.#trips, this.#gaps] = [[], []];
    this.#shown = this.#came = this.#bytes = 0;
    this.#start = now;
    return found;
  }
}

/**
 * Returns true if a report measured no frame times because the picture did not change. The server sends no frames then,
 * so the report says nothing about the display.
 * @param {{ draw: "browser" | "server", frame_ms: number, dropped: number, latency_ms: number | null }} report
 */
export const isStill = ({ draw, frame_ms, dropped, latency_ms }) =>
  draw === "server" && !frame_ms && !dropped && latency_ms === null;

/** @param {number[]} values @param {number} share */
const quantile = (values, share) => values.sort((a, b) => a - b)[Math.floor(share * (values.length - 1))];

/** @param {number} value */
const rounded = (value) => Math.round(10 * value) / 10;
