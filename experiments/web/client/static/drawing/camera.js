// Where the picture is seen from: the person's eye, or anywhere. Points are in the house frame.

import { PerspectiveCamera, Vector3 } from "../vendor/three.js";

/**
 * @typedef {ArrayLike<number>} Point x, y and z, m
 * @typedef {{ position: Point; heading: number; pitch: number }} Eye heading from +x to +y, pitch up, rad
 * @typedef {{ position: Point; target: Point; fovy: number }} FreeCamera vertical field of view, rad
 * @typedef {{ x: number; y: number; ahead: boolean; inView: boolean }} Place in the view, 0 to 1 from its left and top
 */

const NEAR = 0.04; // m, as mjsim draws
const FAR = 100;

/** The house frame has z up, three.js has y up. @param {Vector3} to @param {Point} point */
export function upright(to, point) {
  return to.set(point[0] ?? 0, point[2] ?? 0, -(point[1] ?? 0));
}

export class HouseCamera extends PerspectiveCamera {
  /** Of the eye, rad, whatever the shape of the view. */
  horizontal = 1.5;
  #vertical = 0; // field of view of a free camera, rad; 0 for the eye
  #point = new Vector3();
  /** @type {Place} */
  #place = { x: 0, y: 0, ahead: false, inView: false };

  constructor() {
    super(60, 4 / 3, NEAR, FAR);
    this.rotation.order = "YXZ";
  }

  /** Looks through the person's eyes. @param {Eye} eye */
  setEye({ position, heading, pitch }) {
    this.#setVertical(0);
    upright(this.position, position);
    this.rotation.set(pitch, heading - Math.PI / 2, 0);
    this.updateMatrixWorld();
  }

  /** Looks from anywhere. @param {FreeCamera} camera */
  setFree({ position, target, fovy }) {
    this.#setVertical(fovy);
    upright(this.position, position);
    this.lookAt(upright(this.#point, target));
    this.updateMatrixWorld();
  }

  /** @param {number} angle */
  #setVertical(angle) {
    if (this.#vertical === angle) return;
    this.#vertical = angle;
    this.resize(this.aspect);
  }

  /** @param {number} aspect width over height of the view */
  resize(aspect) {
    const vertical = this.#vertical || 2 * Math.atan(Math.tan(this.horizontal / 2) / aspect);
    this.fov = (vertical * 180) / Math.PI;
    this.aspect = aspect;
    this.updateProjectionMatrix();
  }

  /**
   * Where a point appears.
   * @param {Point} point
   * @returns {Readonly<Place>} the same value at every call
   */
  locate(point) {
    const place = this.#place;
    const seen = upright(this.#point, point).applyMatrix4(this.matrixWorldInverse);
    place.ahead = seen.z < -NEAR;
    seen.applyMatrix4(this.projectionMatrix);
    place.x = (1 + seen.x) / 2;
    place.y = (1 - seen.y) / 2;
    place.inView = place.ahead && Math.max(Math.abs(seen.x), Math.abs(seen.y)) <= 1;
    return place;
  }
}
