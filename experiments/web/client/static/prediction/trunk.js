// The trunk against the house: mjsim/world/fidelity/trunk_contact.py in JavaScript, the same operations in the same order.

/** @typedef {{ edges: ArrayLike<number>, first: ArrayLike<number>, boxes: ArrayLike<number>, near: ArrayLike<number>, near_first: ArrayLike<number>, origin_x: number, origin_y: number, rows: number, columns: number, cell: number, margin: number }} Floor Outlines of the obstacles as in `Floor` of Python, row by row, with the size of its cells and how far they reach, m */

import { VX, VY, X, Y } from "./body.js";

const MAX_STEP = 0.05; // m
const MAX_ROUNDS = 12;
const TOUCHING = 1e-7; // m

/** A disc that slides along the outlines of a house and never enters them. */
export class Trunk {
  #floor;
  #radius;
  #start = 0; // entries of `near` for the cell looked up last
  #end = 0;

  /** @param {Floor} floor @param {number} radius m */
  constructor(floor, radius) {
    this.#floor = floor;
    this.#radius = radius;
  }

  /**
   * Whether no outline comes within these distances along x and y, m.
   * @param {number} x @param {number} y @param {number} reachX @param {number} reachY
   */
  isClear(x, y, reachX, reachY) {
    const { boxes, near, margin } = this.#floor;
    if (Math.max(reachX, reachY) > this.#radius + margin) return false;
    this.#lookUp(x, y);
    for (let entry = this.#start; entry < this.#end; entry++) {
      if (meets(boxes, at(near, entry), x, y, reachX, reachY)) return false;
    }
    return true;
  }

  /**
   * Moves a body by its velocity for `h` s, sliding along what it meets.
   * @param {Float64Array} body @param {number} h
   */
  slide(body, h) {
    const [vx, vy] = [at(body, VX), at(body, VY)];
    const parts = 1 + Math.trunc((h * Math.sqrt(vx * vx + vy * vy)) / MAX_STEP);
    for (let i = 0; i < parts; i++) {
      const [x, y] = [at(body, X), at(body, Y)];
      body[X] = x + at(body, VX) * (h / parts);
      body[Y] = y + at(body, VY) * (h / parts);
      this.#lookUp(x, y);
      if (this.#start < this.#end && !this.#pushOut(body)) {
        [body[X], body[Y], body[VX], body[VY]] = [x, y, 0, 0]; // wedged between walls
      }
    }
  }

  /** @param {number} x @param {number} y */
  #lookUp(x, y) {
    const { origin_x, origin_y, rows, columns, near_first, cell } = this.#floor;
    const [i, j] = [Math.floor((x - origin_x) / cell), Math.floor((y - origin_y) / cell)];
    const inside = 0 <= i && i < rows && 0 <= j && j < columns;
    this.#start = inside ? at(near_first, i * columns + j) : 0;
    this.#end = inside ? at(near_first, i * columns + j + 1) : 0;
  }

  /** @param {Float64Array} body */
  #pushOut(body) {
    const { boxes, near, first } = this.#floor;
    const radius = this.#radius;
    for (let round = 0; round < MAX_ROUNDS; round++) {
      let free = true;
      for (let entry = this.#start; entry < this.#end; entry++) {
        const polygon = at(near, entry);
        if (!meets(boxes, polygon, at(body, X), at(body, Y), radius, radius)) continue;
        const [distance, nx, ny] = this.#gapTo(at(body, X), at(body, Y), at(first, polygon), at(first, polygon + 1));
        if (distance >= radius - TOUCHING) continue;
        free = false;
        body[X] = at(body, X) + nx * (radius - distance);
        body[Y] = at(body, Y) + ny * (radius - distance);
        const into = nx * at(body, VX) + ny * at(body, VY);
        if (into < 0) {
          body[VX] = at(body, VX) - into * nx;
          body[VY] = at(body, VY) - into * ny;
        }
      }
      if (free) return true;
    }
    return false;
  }

  /**
   * The signed distance to a convex polygon, negative inside, and the unit vector away from it.
   * @param {number} x @param {number} y @param {number} from its first edge @param {number} to after its last
   * @returns {[number, number, number]}
   */
  #gapTo(x, y, from, to) {
    const { edges } = this.#floor;
    let [nearest, nearX, nearY] = [Infinity, 0, 0];
    let [depth, outX, outY] = [-Infinity, 0, 0];
    for (let edge = 5 * from; edge < 5 * to; edge += 5) {
      let [dx, dy] = [x - at(edges, edge), y - at(edges, edge + 1)];
      const [ex, ey] = [at(edges, edge + 2), at(edges, edge + 3)];
      const beside = dx * ey - dy * ex;
      if (beside > depth) [depth, outX, outY] = [beside, ey, -ex];
      const along = Math.min(at(edges, edge + 4), Math.max(0, dx * ex + dy * ey));
      dx -= along * ex;
      dy -= along * ey;
      const distance = dx * dx + dy * dy;
      if (distance < nearest) [nearest, nearX, nearY] = [distance, dx, dy];
    }
    nearest = Math.sqrt(nearest);
    return depth <= 0 || nearest < 1e-12 ? [depth, outX, outY] : [nearest, nearX / nearest, nearY / nearest];
  }
}

/**
 * @param {ArrayLike<number>} boxes @param {number} polygon @param {number} x @param {number} y
 * @param {number} reachX @param {number} reachY
 */
function meets(boxes, polygon, x, y, reachX, reachY) {
  const box = 4 * polygon;
  return (
    at(boxes, box) - reachX < x &&
    x < at(boxes, box + 1) + reachX &&
    at(boxes, box + 2) - reachY < y &&
    y < at(boxes, box + 3) + reachY
  );
}

/** @param {ArrayLike<number>} values @param {number} index @returns {number} */
const at = (values, index) => /** @type {number} */ (values[index]);
