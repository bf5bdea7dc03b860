// A recorded run: what `mjsim view` writes into its page, and the state at any time.

/** @import { HudState, Marker } from "../protocol.js" */

import { mixed } from "../prediction/poses.js";

/** @typedef {{ t: number, kind: string, text: string }} Moment */
/** @typedef {{ t: number, cost_m: number, status: string, path: number[] }} Plan */
/** @typedef {{ person: { eye_height: number, eye_forward: number, body_radius: number, field_of_view: number }, bounds: [number, number, number, number], models: Record<string, string>, time: number[], body: number[], hands: number[], objects: Record<string, number[]>, hud: [number, HudState][], markers: Marker[], shown: [number, number[]][], moments: Moment[], plans: Plan[], pictures: Record<string, string> }} Recorded as `RunRecorder` and `view_page` write it */

const [BODY, HANDS, POSE] = [4, 6, 8]; // numbers of a step

export class Run {
  recorded;

  /** @param {Recorded} recorded */
  constructor(recorded) {
    this.recorded = recorded;
  }

  /** Duration, in seconds. */
  get duration() {
    return this.recorded.time.at(-1) ?? 0;
  }

  /** Returns the control step at a time, and the elapsed share of it. @param {number} time s */
  at(time) {
    const times = this.recorded.time;
    const step = Math.max(0, lastUpTo(time, times.length, (i) => times[i]));
    const [start = 0, end = Infinity] = times.slice(step, step + 2);
    return { step, share: Math.min(1, Math.max(0, (time - start) / (end - start))) };
  }

  /** Position, heading and pitch of the body. @param {number} step @param {number} share */
  body(step, share) {
    const [a, b] = this.#pair(this.recorded.body, BODY, step);
    const [from = 0, to = 0] = [a[2], b[2]];
    const between = blended(a, b, share);
    between[2] = from + share * Math.atan2(Math.sin(to - from), Math.cos(to - from));
    return between;
  }

  /** Both hands in the frame of the body, m. @param {number} step @param {number} share */
  hands(step, share) {
    const between = blended(...this.#pair(this.recorded.hands, HANDS, step), share);
    return [between.slice(0, 3), between.slice(3)];
  }

  /** Where objects are: position, m, and quaternion wxyz. @param {number} step @param {number} share */
  *poses(step, share) {
    for (const [name, rows] of Object.entries(this.recorded.objects)) {
      const row = POSE * Math.max(0, lastUpTo(step, rows.length / POSE, (i) => rows[POSE * i]));
      const pose = rows.slice(row + 1, row + POSE);
      const next = rows.slice(row + POSE, row + 2 * POSE);
      yield { name, pose: next[0] === step + 1 ? mixed(pose, next.slice(1), share) : pose };
    }
  }

  /** @param {number} step */
  hud(step) {
    return valueAt(this.recorded.hud, step);
  }

  /** @param {number} step @returns {Marker[]} */
  markers(step) {
    return valueAt(this.recorded.shown, step).map((index) => /** @type {Marker} */ (this.recorded.markers[index]));
  }

  /** Returns the current plan at a time. @param {number} time s */
  plan(time) {
    return this.recorded.plans.findLast((plan) => plan.t <= time);
  }

  /** Floor points that were walked up to a step, flat, m. @param {number} step */
  walked(step) {
    return this.recorded.body.slice(0, BODY * (step + 1)).filter((_, i) => i % BODY < 2);
  }

  /** @param {number[]} values @param {number} size @param {number} step @returns {[number[], number[]]} */
  #pair(values, size, step) {
    const next = Math.min(step + 1, this.recorded.time.length - 1);
    return [values.slice(size * step, size * (step + 1)), values.slice(size * next, size * (next + 1))];
  }
}

/** Index of the last of `count` ascending values that is not above a limit, or -1. @param {number} limit @param {number} count @param {(index: number) => number | undefined} value */
function lastUpTo(limit, count, value) {
  let [low, high] = [0, count];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((value(middle) ?? Infinity) <= limit) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** The value that holds at a step. @template T @param {[number, T][]} changes @param {number} step @returns {T} */
function valueAt(changes, step) {
  const found = changes[Math.max(0, lastUpTo(step, changes.length, (i) => changes[i]?.[0]))];
  if (!found) throw new Error("the run shows nothing");
  return found[1];
}

/** @param {number[]} a @param {number[]} b @param {number} share of b */
const blended = (a, b, share) => a.map((value, i) => value + share * ((b[i] ?? value) - value));
