// The person's arms: sleeves join hands and shoulders, and idle hands hang at rest. Same as mjsim/house/scene/arms.py.

import { Vector3 } from "../vendor/three.js";

/** @import { Object3D } from "../vendor/three.js" */
/**
 * @typedef {{ rest: number[], hanging: number[], shoulder: number[], wrist: number[], tilt: number, range: number, half: number, eye_height: number }} ArmShape
 *   positions in the frame of the body, for a person with this eye height, and half the length of the sleeve, m
 */

const UP = new Vector3(0, 0, 1);
const LEFT = new Vector3(0, 1, 0);

export class Arm {
  #hand;
  #sleeve;
  #shape;
  #wrist = new Vector3();
  #along = new Vector3();

  /** @param {Object3D} hand @param {Object3D} sleeve @param {ArmShape} shape */
  constructor(hand, sleeve, shape) {
    this.#hand = hand;
    this.#sleeve = sleeve;
    this.#shape = shape;
  }

  /** @param {number[]} place of the hand in the frame of the body, m @param {number} [eyeHeight] m */
  pose(place, eyeHeight = this.#shape.eye_height) {
    const { rest, hanging, shoulder, wrist, tilt, range, half } = this.#shape;
    const size = [1, 1, eyeHeight / this.#shape.eye_height];
    const idle = (/** @type {number} */ i) => (rest[i] ?? 0) * (size[i] ?? 1);
    const near = Math.max(0, 1 - Math.hypot(...place.map((value, i) => value - idle(i))) / range);
    const share = near * near * (3 - 2 * near);
    const drawn = place.map((value, i) => value + share * ((hanging[i] ?? 0) * (size[i] ?? 1) - idle(i)));
    this.#hand.position.fromArray(drawn);
    this.#hand.quaternion.setFromAxisAngle(LEFT, share * tilt);
    this.#hand.updateMatrix();
    this.#wrist.fromArray(wrist).applyMatrix4(this.#hand.matrix);
    this.#along.fromArray(shoulder.map((value, i) => value * (size[i] ?? 1))).sub(this.#wrist);
    this.#sleeve.position.copy(this.#wrist).addScaledVector(this.#along, 0.5);
    this.#sleeve.scale.z = this.#along.length() / 2 / half;
    this.#sleeve.quaternion.setFromUnitVectors(UP, this.#along.normalize());
    this.#sleeve.updateMatrix();
  }
}
