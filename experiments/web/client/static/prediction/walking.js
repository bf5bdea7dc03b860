// Walking and looking: mjsim/world/fidelity/kinematics.py in JavaScript, the same operations in the same order.
// Where the host's `hypot`, `sin` or `cos` differ in the last bit, the server's next state sets that right.

/** @import { Floor } from "./trunk.js" */

import { FORWARD, HEADING, LEFT, LOOK, PITCH, PITCH_RATE, SERVO, TURN, TURN_RATE, VX, VY, X, Y } from "./body.js";
import { Trunk } from "./trunk.js";

/** @typedef {{ max_speed: number, max_turn: number, max_look: number, acceleration: number, turn_acceleration: number, dt: number, substeps: number, mass: number, walk_gain: number, walk_force: number, inertia: number, turn_gain: number, turn_force: number, head_inertia: number, head_stiffness: number, head_damping: number, head_force: number, lowest: number, highest: number, radius: number }} Gait as in Python */
/** @typedef {{ forward: number, left: number, turn: number, look: number }} Move m/s and rad/s */
/** @typedef {[keep: number, damped: number, undamped: number]} Servo share of its speed that it keeps in a physics step, speed per force damped, and undamped */

/** @type {Readonly<Move>} */
export const IDLE = Object.freeze({ forward: 0, left: 0, turn: 0, look: 0 });

export class Walker {
  #gait;
  #trunk;
  #h;
  /** @type {Servo} */
  #walk;
  /** @type {Servo} */
  #turn;
  /** @type {Servo} */
  #head;

  /** @param {Gait} gait @param {Floor} floor */
  constructor(gait, floor) {
    this.#gait = gait;
    this.#trunk = new Trunk(floor, gait.radius);
    this.#h = gait.dt / gait.substeps;
    this.#walk = servo(gait.mass, gait.walk_gain, this.#h);
    this.#turn = servo(gait.inertia, gait.turn_gain, this.#h);
    this.#head = servo(gait.head_inertia, gait.head_damping, this.#h);
  }

  /** One control step. @param {Float64Array} body which it changes @param {Readonly<Move>} move */
  step(body, move) {
    this.#command(body, move);
    this.#advance(body);
  }

  /** Slews the commands towards those of a move. @param {Float64Array} b @param {Readonly<Move>} move */
  #command(b, { forward, left, turn, look }) {
    const g = this.#gait;
    const speed = Math.hypot(forward, left);
    if (speed > g.max_speed) [forward, left] = [forward * (g.max_speed / speed), left * (g.max_speed / speed)];
    const [changeF, changeL, most] = [forward - of(b, FORWARD), left - of(b, LEFT), g.acceleration * g.dt];
    const size = Math.hypot(changeF, changeL);
    if (size <= most) [b[FORWARD], b[LEFT]] = [forward, left];
    else [b[FORWARD], b[LEFT]] = [of(b, FORWARD) + changeF * (most / size), of(b, LEFT) + changeL * (most / size)];
    b[TURN] = of(b, TURN) + within(within(turn, g.max_turn) - of(b, TURN), g.turn_acceleration * g.dt);
    const rate = within(look, g.max_look);
    if (rate !== 0) b[LOOK] = Math.min(g.highest, Math.max(g.lowest, of(b, LOOK) + rate * g.dt));
  }

  /** Lets servos and trunk follow the commands. @param {Float64Array} b */
  #advance(b) {
    const [g, h, n] = [this.#gait, this.#h, this.#gait.substeps];
    const heading = of(b, HEADING) + 0.5 * of(b, TURN) * g.dt;
    const [c, s] = [Math.cos(heading), Math.sin(heading)];
    const toX = c * of(b, FORWARD) - s * of(b, LEFT);
    const toY = s * of(b, FORWARD) + c * of(b, LEFT);
    const [toTurn, toPitch] = [of(b, TURN), of(b, LOOK)];
    const [fromX, fromY] = [of(b, SERVO), of(b, SERVO + 1)];
    const [fromTurn, fromPitch] = [of(b, SERVO + 2), of(b, SERVO + 3)];
    const [rampX, rampY] = [(toX - fromX) / n, (toY - fromY) / n];
    const [rampTurn, rampPitch] = [(toTurn - fromTurn) / n, (toPitch - fromPitch) / n];
    const reachX = g.radius + g.dt * Math.max(Math.abs(of(b, VX)), Math.abs(fromX), Math.abs(toX));
    const reachY = g.radius + g.dt * Math.max(Math.abs(of(b, VY)), Math.abs(fromY), Math.abs(toY));
    const free = this.#trunk.isClear(of(b, X), of(b, Y), reachX, reachY);
    for (let k = 1; k <= n; k++) {
      const pushX = g.walk_gain * (fromX + k * rampX);
      const pushY = g.walk_gain * (fromY + k * rampY);
      const torque = g.turn_gain * (fromTurn + k * rampTurn);
      const spring = g.head_stiffness * (fromPitch + k * rampPitch - of(b, PITCH));
      b[VX] = driven(of(b, VX), pushX, g.walk_gain, g.walk_force, this.#walk);
      b[VY] = driven(of(b, VY), pushY, g.walk_gain, g.walk_force, this.#walk);
      b[TURN_RATE] = driven(of(b, TURN_RATE), torque, g.turn_gain, g.turn_force, this.#turn);
      b[PITCH_RATE] = driven(of(b, PITCH_RATE), spring, g.head_damping, g.head_force, this.#head);
      if (free) [b[X], b[Y]] = [of(b, X) + h * of(b, VX), of(b, Y) + h * of(b, VY)];
      else this.#trunk.slide(b, h);
      b[HEADING] = of(b, HEADING) + h * of(b, TURN_RATE);
      b[PITCH] = of(b, PITCH) + h * of(b, PITCH_RATE);
    }
    [b[SERVO], b[SERVO + 1], b[SERVO + 2], b[SERVO + 3]] = [toX, toY, toTurn, toPitch];
  }
}

/** @param {number} mass @param {number} damping @param {number} h @returns {Servo} */
const servo = (mass, damping, h) => [mass / (mass + h * damping), h / (mass + h * damping), h / mass];

/**
 * Speed after a physics step under the force `push - damping * speed`, implicit in the damping unless saturated.
 * @param {number} speed @param {number} push @param {number} damping @param {number} limit @param {Servo} servo_
 */
function driven(speed, push, damping, limit, [keep, damped, undamped]) {
  const force = push - damping * speed;
  if (force > limit || force < -limit) return speed + undamped * within(force, limit);
  return keep * speed + damped * push;
}

/** The nearest value in -limit to limit. @param {number} value @param {number} limit */
export const within = (value, limit) => Math.min(limit, Math.max(-limit, value));

/** @param {Float64Array} body @param {number} index @returns {number} */
const of = (body, index) => /** @type {number} */ (body[index]);
