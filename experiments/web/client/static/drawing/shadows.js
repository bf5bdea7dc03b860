// Contact shadows: a soft dark spot under every object near the floor, as wide as its box and fainter as it is lifted.

import { Matrix4, PlaneGeometry, Quaternion, Vector3 } from "../vendor/three.js";
import { houseMaterial } from "./house_material.js";
import { Instances } from "./instances.js";

/** @import { Object3D, Texture } from "../vendor/three.js" */
/** @import { Uniforms } from "./house_material.js" */
/**
 * @typedef {{ rgba: number[]; border: number; lift: number; reach: number; texture: string }} ContactShadow in m
 * @typedef {number[]} Box centre (3), half-sizes (3) and turn (w, x, y, z) in the object's frame
 */

const CAPACITY = 128; // spots in a house

export class ContactShadows extends Instances {
  #settings;
  #pose = new Matrix4();
  #place = new Vector3();
  #turn = new Quaternion();
  #scale = new Vector3();
  #low = new Vector3();
  #high = new Vector3();

  /** @param {Uniforms} light @param {ContactShadow} settings @param {Texture} map */
  constructor(light, settings, map) {
    super(new PlaneGeometry(2, 2), houseMaterial(light, { map, blend: true, tinted: true }), CAPACITY);
    this.renderOrder = 2; // between planes and the rest that one can see through
    this.#settings = settings;
  }

  /**
   * The spot under an object.
   * @param {Object3D} object
   * @param {Box[]} boxes
   */
  under(object, boxes) {
    const { rgba: [red = 0, green = 0, blue = 0, opacity = 0], border, lift, reach } = this.#settings;
    this.#low.setScalar(Infinity);
    this.#high.setScalar(-Infinity);
    for (const box of boxes) this.#include(object, box);
    const height = Math.max(this.#low.z, 0);
    if (!(height < reach)) return;
    this.#scale.subVectors(this.#high, this.#low).multiplyScalar(0.5).addScalar(border);
    this.#place.addVectors(this.#low, this.#high).multiplyScalar(0.5).setZ(height + lift);
    this.#pose.compose(this.#place, this.#turn.identity(), this.#scale);
    this.put(this.#pose, red, green, blue, opacity * (1 - height / reach));
  }

  /** @param {Object3D} object @param {Box} box */
  #include(object, [x = 0, y = 0, z = 0, a = 0, b = 0, c = 0, qw = 1, qx = 0, qy = 0, qz = 0]) {
    this.#place.set(x, y, z).applyMatrix4(object.matrix);
    this.#turn.set(qx, qy, qz, qw).premultiply(object.quaternion);
    const m = this.#pose.makeRotationFromQuaternion(this.#turn).elements;
    for (let axis = 0; axis < 3; axis++) {
      const half = Math.abs(m[axis] ?? 0) * a + Math.abs(m[axis + 4] ?? 0) * b + Math.abs(m[axis + 8] ?? 0) * c;
      const middle = this.#place.getComponent(axis);
      this.#low.setComponent(axis, Math.min(this.#low.getComponent(axis), middle - half));
      this.#high.setComponent(axis, Math.max(this.#high.getComponent(axis), middle + half));
    }
  }
}
