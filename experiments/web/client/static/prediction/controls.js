// From inputs of a person to the move of a control step: experiments/web/controls.py in JavaScript.

/** @import { Input } from "../protocol.js" */
/** @import { Move } from "./walking.js" */

import { IDLE, within } from "./walking.js";

const MAX_PITCH = 1.2; // rad that the mouse can look up or down
const MAX_TURN_AHEAD = 2.8; // rad that the mouse can be ahead of the body

/** @typedef {{ walking_speed: number, turning_speed: number, looking_speed: number }} Speeds m/s and rad/s */
/** @typedef {{ held: Input | null, heading: number | null, pitch: number | null }} Controls what is held down, and where the mouse points, rad */

/** @type {Readonly<Controls>} */
export const AT_REST = Object.freeze({ held: null, heading: null, pitch: null });

/**
 * The controls after further inputs, and the move that they ask for; a step with a press has no move.
 * @param {Controls} before
 * @param {readonly Input[]} inputs of this control step
 * @param {number} heading of the body, rad
 * @param {number} pitch of the head, rad
 * @param {Speeds} speeds
 * @param {number} duration of a control step, s
 * @returns {{ controls: Controls, move: Readonly<Move>, pressed: boolean }}
 */
export function controlStep(before, inputs, heading, pitch, speeds, duration) {
  const controls = taken(before, inputs, heading, pitch);
  const pressed = inputs.some((input) => input.press);
  if (pressed) return { controls, move: IDLE, pressed };
  const asked = controls.held ? [...inputs, controls.held] : inputs;
  const [forward, left] = [fastest(asked, "forward"), fastest(asked, "left")];
  const speed = speeds.walking_speed / Math.max(1, Math.hypot(forward, left)); // walking diagonally is not faster
  let turn = fastest(asked, "turn") * speeds.turning_speed;
  let look = fastest(asked, "look") * speeds.looking_speed;
  if (controls.heading !== null && !turn) turn = within(gap(controls.heading, heading) / duration, speeds.turning_speed);
  if (controls.pitch !== null && !look) look = within((controls.pitch - pitch) / duration, speeds.looking_speed);
  return { controls, move: { forward: forward * speed, left: left * speed, turn, look }, pressed };
}

/**
 * @param {Controls} before @param {readonly Input[]} inputs @param {number} heading @param {number} pitch
 * @returns {Controls}
 */
function taken(before, inputs, heading, pitch) {
  let { heading: toHeading, pitch: toPitch } = before;
  for (const input of inputs) {
    if (input.yaw) {
      const ahead = toHeading === null ? 0 : gap(toHeading, heading);
      toHeading = heading + within(ahead + input.yaw, MAX_TURN_AHEAD);
    }
    if (input.pitch) toPitch = within((toPitch ?? pitch) + input.pitch, MAX_PITCH);
    if (input.turn) toHeading = null;
    if (input.look) toPitch = null;
  }
  return { held: inputs.at(-1) ?? before.held, heading: toHeading, pitch: toPitch };
}

/** The value that is furthest from 0. @param {readonly Input[]} inputs @param {"forward" | "left" | "turn" | "look"} name */
const fastest = (inputs, name) =>
  inputs.map((input) => input[name] ?? 0).reduce((most, value) => (Math.abs(value) > Math.abs(most) ? value : most), 0);

/** The shorter turn from one heading to another, rad. @param {number} angle @param {number} start */
function gap(angle, start) {
  const turns = angle - start + Math.PI;
  return turns - 2 * Math.PI * Math.floor(turns / (2 * Math.PI)) - Math.PI;
}
