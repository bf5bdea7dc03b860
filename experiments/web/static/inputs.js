// Joins keyboard, mouse, gamepad and touch into one stream of inputs.

const PERIOD = 20; // ms between two inputs of mouse and wheel
const AXES = ["forward", "left", "turn", "look"];
const LARGEST_ANGLE = 7; // rad
const LARGEST_SCROLL = 100; // rows

export class Inputs {
  #send;
  #held = new Map(); // source -> axes
  #yaw = 0;
  #pitch = 0;
  #rows = 0;
  #timer = null;

  /** @param {(input: object) => void} send */
  constructor(send) {
    this.#send = send;
  }

  /** What a source holds down from now on, each axis from -1 to 1. */
  hold(source, axes) {
    const before = JSON.stringify(this.#axes());
    this.#held.set(source, axes);
    if (JSON.stringify(this.#axes()) !== before) this.#flush();
  }

  /** Says what is held down, to a session that may know it from an earlier page. */
  repeat() {
    this.#flush();
  }

  /** Lets everything go. */
  release() {
    const some = Object.keys(this.#axes()).length > 0;
    this.#held.clear();
    if (some) this.#flush();
  }

  /** A press of the action key or of the key of a hand. */
  press(press) {
    this.#flush({ press });
  }

  /** Turns and looks by angles, rad. */
  look(yaw, pitch) {
    this.#yaw += yaw;
    this.#pitch += pitch;
    this.#soon();
  }

  /** Scrolls the list by rows. */
  scroll(rows) {
    this.#rows += rows;
    this.#soon();
  }

  #soon() {
    this.#timer ??= setTimeout(() => this.#flush(), PERIOD);
  }

  #flush(more = {}) {
    clearTimeout(this.#timer);
    this.#timer = null;
    const input = { ...this.#axes(), ...more };
    if (this.#yaw) input.yaw = limited(this.#yaw, LARGEST_ANGLE);
    if (this.#pitch) input.pitch = limited(this.#pitch, LARGEST_ANGLE);
    if (this.#rows) input.scroll = limited(this.#rows, LARGEST_SCROLL);
    this.#yaw = this.#pitch = this.#rows = 0;
    this.#send(input);
  }

  #axes() {
    const sum = {};
    for (const axis of AXES) {
      let value = 0;
      for (const held of this.#held.values()) value += held[axis] ?? 0;
      if (value) sum[axis] = limited(value, 1);
    }
    return sum;
  }
}

const limited = (value, limit) => Math.max(-limit, Math.min(limit, value));
