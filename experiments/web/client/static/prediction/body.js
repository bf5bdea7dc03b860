// Layout of the 16 numbers of a body, as mjsim/world/body/rig.py has it.

export const [X, Y, HEADING, PITCH] = [0, 1, 2, 3]; // m, m, rad (unwrapped), rad
export const [VX, VY, TURN_RATE, PITCH_RATE] = [4, 5, 6, 7]; // in the house frame, m/s, rad/s
export const [FORWARD, LEFT, TURN, LOOK] = [8, 9, 10, 11]; // commanded: m/s and rad/s in the body frame; pitch, rad
export const SERVO = 12; // first of four: the latest commands of x, y, yaw and pitch
export const BODY_SIZE = 16;

/** @typedef {{ position: [number, number, number], heading: number, pitch: number }} Eye in the house frame, m and rad */

/**
 * The eye of a body, as `avatar.eye_position` has it.
 * @param {ArrayLike<number>} body
 * @param {{ eye_height: number, eye_forward: number }} person m
 * @returns {Eye}
 */
export function eyeOf(body, { eye_height, eye_forward }) {
  const [x = 0, y = 0, heading = 0, pitch = 0] = Array.from(body);
  const out = eye_forward * Math.cos(pitch);
  const position = [x + out * Math.cos(heading), y + out * Math.sin(heading), eye_height + eye_forward * Math.sin(pitch)];
  return { position: /** @type {[number, number, number]} */ (position), heading, pitch };
}
