// Joins keyboard, mouse, gamepad and touch into one stream of inputs.

/** @import { Input } from "./protocol.js" */
/** @import { Axes } from "./bindings.js" */

const PERIOD = 20; // period of inputs of mouse and wheel, in ms
/** @type {(keyof Axes)[]} */
const AXES = ["forward", "left", "turn", "look"];
const MAX_ANGLE = 7; // rad
const MAX_SCROLL = 100; // rows

export class Inputs {
  #on;
  /** @type {Map<string, Axes>} */
  #held = new Map(); // sources (keys, sticks) -> axes
  #yaw = 0;
  #pitch = 0;
  #rows = 0;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #timer;

  /** @param {(input: Omit<Input, "number">) => void} on is called with every input */
  constructor(on) {
    this.#on = on;
  }

  /**
   * Sets the axes held by a source.
   * @param {string} source a key, a stick or a button on the screen
   * @param {Axes} axes
   */
  hold(source, axes) {
    const before = JSON.stringify(this.#axes());
    this.#held.set(source, axes);
    if (JSON.stringify(this.#axes()) !== before) this.send();
  }

  /** Releases everything. */
  release() {
    const some = Object.keys(this.#axes()).length > 0;
    this.#held.clear();
    if (some) this.send();
  }

  /**
   * Presses the action key or the key of a hand.
   * @param {NonNullable<Input["press"]>} press
   */
  press(press) {
    this.send({ press });
  }

  /**
   * Turns and looks by angles, rad.
   * @param {number} yaw
   * @param {number} pitch
   */
  look(yaw, pitch) {
    this.#yaw += yaw;
    this.#pitch += pitch;
    this.#soon();
  }

  /**
   * Scrolls the list.
   * @param {number} rows
   */
  scroll(rows) {
    this.#rows += rows;
    this.#soon();
  }

  #soon() {
    this.#timer ??= setTimeout(() => this.send(), PERIOD);
  }

  /** Sends the held axes and the collected movement. @param {Pick<Input, "press">} more */
  send(more = {}) {
    clearTimeout(this.#timer);
    this.#timer = undefined;
    /** @type {Omit<Input, "number">} */
    const input = { ...this.#axes(), ...more };
    if (this.#yaw) input.yaw = limited(this.#yaw, MAX_ANGLE);
    if (this.#pitch) input.pitch = limited(this.#pitch, MAX_ANGLE);
    if (this.#rows) input.scroll = limited(this.#rows, MAX_SCROLL);
    this.#yaw = this.#pitch = this.#rows = 0;
    this.#on(input);
  }

  #axes() {
    /** @type {Axes} */
    const sum = {};
    for (const axis of AXES) {
      const all = [...this.#held.values()].reduce((total, axes) => total + (axes[axis] ?? 0), 0);
      if (all) sum[axis] = limited(all, 1);
    }
    return sum;
  }
}

/** @param {number} value @param {number} limit */
const limited = (value, limit) => Math.max(-limit, Math.min(limit, value));
