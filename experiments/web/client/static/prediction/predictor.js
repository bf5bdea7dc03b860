// The person's walk as the server will compute it. Inputs count at the control step for which they were made, so the
// prediction is exact, except where the server decides: on a pick, a place, or a step without its inputs.

/** @import { Input } from "../protocol.js" */
/** @import { Controls, Speeds } from "./controls.js" */
/** @import { Walker } from "./walking.js" */

import { BODY_SIZE, HEADING, PITCH, X, Y } from "./body.js";
import { AT_REST, controlStep } from "./controls.js";

const KEPT = 128; // control steps kept for corrections, about 5 s
const SAME = 1e-6; // tolerance for rounding, in metres and radians
const FADING = 0.1; // time constant of fading corrections, in seconds
const TOO_FAR = 1.5; // size from which a correction is not faded, in metres
const POSE = 4; // numbers: x, y, heading and pitch

/** @typedef {{ body: Float64Array, controls: Controls, inputs: readonly Input[] }} Kept a control step: the state before it, and the inputs that count at it */

export class Predictor {
  step; // next control step
  predicting; // false during a pick or place, or if the walk is simulated by physics
  #walker;
  #speeds;
  #duration;
  #body = new Float64Array(BODY_SIZE);
  /** @type {Controls} */
  #controls = AT_REST;
  /** @type {Map<number, Kept>} */
  #kept = new Map();
  /** @type {Input[]} */
  #pending = []; // made since the last control step
  #fading = new Float64Array(POSE); // shown minus true position
  #drawn = new Float64Array(POSE);
  #ahead = new Float64Array(BODY_SIZE);

  /**
   * @param {Walker | null} walker null where walks cannot be predicted
   * @param {Speeds} speeds @param {number} duration of a control step, s
   * @param {number} step the next one @param {ArrayLike<number>} body
   */
  constructor(walker, speeds, duration, step, body) {
    this.#walker = walker;
    this.predicting = walker !== null;
    this.#speeds = speeds;
    this.#duration = duration;
    this.step = step;
    this.#body.set(body);
  }

  /** Adds an input for the next control step. @param {Input} input */
  add(input) {
    this.#pending.push(input);
  }

  /** Takes a control step. */
  advance() {
    const inputs = this.#pending;
    this.#pending = [];
    this.#kept.set(this.step, { body: this.#body.slice(), controls: this.#controls, inputs });
    this.#kept.delete(this.step - KEPT);
    this.#controls = this.#apply(this.#body, this.#controls, inputs);
    this.step++;
    this.#fading = this.#fading.map((value) => value * Math.exp(-this.#duration / FADING));
  }

  /** The state with which the next control step begins. */
  get body() {
    return this.#body.slice();
  }

  /**
   * Compares a state of the server with the prediction, and continues from it if they differ.
   * @param {number} step that begins with this state
   * @param {ArrayLike<number>} body
   * @param {boolean} busy
   */
  correct(step, body, busy) {
    const mine = step === this.step ? this.#body : this.#kept.get(step)?.body;
    const before = this.predicting;
    this.predicting = !busy && this.#walker !== null;
    if (mine && before === this.predicting && !differ(mine, body)) return;
    const shown = this.drawn(0).slice();
    this.#body.set(body);
    const from = this.#kept.get(step);
    if (from) this.#controls = from.controls;
    for (let k = step; k < this.step; k++) {
      const kept = this.#kept.get(k);
      if (!kept) break;
      kept.body.set(this.#body);
      kept.controls = this.#controls;
      this.#controls = this.#apply(this.#body, this.#controls, kept.inputs);
    }
    if (step > this.step) [this.step, this.#kept] = [step, new Map()]; // the server is ahead
    this.#fading.fill(0);
    const now = this.drawn(0);
    const error = Math.hypot((shown[X] ?? 0) - (now[X] ?? 0), (shown[Y] ?? 0) - (now[Y] ?? 0));
    if (error < TOO_FAR) this.#fading.set(shown.map((value, i) => value - (now[i] ?? 0)));
  }

  /**
   * Position, heading and pitch to draw at a share of the next control step: on the way to where the inputs so far
   * lead, so that an input shows in the next picture.
   * @param {number} share 0 to 1
   * @returns {Float64Array} valid until the next call
   */
  drawn(share) {
    const [drawn, body, ahead] = [this.#drawn, this.#body, this.#ahead];
    ahead.set(body);
    this.#apply(ahead, this.#controls, this.#pending);
    const left = Math.exp((-share * this.#duration) / FADING);
    for (let i = 0; i < POSE; i++) {
      const [from, to] = [body[i] ?? 0, ahead[i] ?? 0];
      drawn[i] = from + share * (to - from) + left * (this.#fading[i] ?? 0);
    }
    return drawn;
  }

  /** @param {Float64Array} body @param {Controls} controls @param {readonly Input[]} inputs */
  #apply(body, controls, inputs) {
    const [heading, pitch] = [body[HEADING] ?? 0, body[PITCH] ?? 0];
    const next = controlStep(controls, inputs, heading, pitch, this.#speeds, this.#duration);
    if (this.predicting) this.#walker?.step(body, next.move);
    return next.controls;
  }
}

/** @param {ArrayLike<number>} a @param {ArrayLike<number>} b */
function differ(a, b) {
  for (let i = 0; i < BODY_SIZE; i++) if (!(Math.abs((a[i] ?? 0) - (b[i] ?? 0)) < SAME)) return true;
  return false;
}
