// Where objects are drawn: on the way to where the server last said, in the house or, in a hand, with the body.

/** @import { Snapshot } from "../protocol.js" */

const GLIDE = 0.05; // s from one known pose to the next: a state comes every 0.04 s

/** @typedef {number[]} Pose position, m, and quaternion wxyz */
/** @typedef {{ carried: boolean, from: Pose, to: Pose, start: number }} Glide in the frame of the body where it is carried */

export class Poses {
  /** @type {Map<string, Glide>} */
  #glides = new Map();

  /**
   * Takes what a state says.
   * @param {Pick<Snapshot, "objects" | "gone" | "held" | "body">} state
   * @param {number} now s
   * @param {ArrayLike<number>} drawn the body on show
   */
  take({ objects, gone, held, body }, now, drawn) {
    for (const name of gone) this.#glides.delete(name);
    for (const [name, glide] of this.#glides) {
      if (glide.carried && !held.includes(name) && !objects[name]) this.#move(name, this.at(name, now, drawn) ?? glide.to, false, now, drawn, drawn);
    }
    for (const [name, pose] of Object.entries(objects)) this.#move(name, pose, held.includes(name), now, drawn, body);
  }

  /** Names of all objects that are known. */
  names() {
    return this.#glides.keys();
  }

  /**
   * The pose in the house, or undefined.
   * @param {string} name @param {number} now s @param {ArrayLike<number>} body on show
   * @returns {Pose | undefined}
   */
  at(name, now, body) {
    const glide = this.#glides.get(name);
    if (!glide) return undefined;
    const pose = mixed(glide.from, glide.to, Math.min(1, (now - glide.start) / GLIDE));
    return glide.carried ? toHouse(pose, body) : pose;
  }

  /**
   * @param {string} name @param {Pose} pose in the house @param {boolean} carried @param {number} now
   * @param {ArrayLike<number>} drawn @param {ArrayLike<number>} body with which the pose was
   */
  #move(name, pose, carried, now, drawn, body) {
    const before = this.at(name, now, drawn);
    const to = carried ? toBody(pose, body) : pose;
    const from = before ? (carried ? toBody(before, drawn) : before) : to;
    this.#glides.set(name, { carried, from, to, start: now });
  }
}

/** @param {Pose} pose in the house @param {ArrayLike<number>} body @returns {Pose} in the frame of the body */
export function toBody(pose, body) {
  const [x = 0, y = 0, heading = 0] = Array.from(body);
  const [px = 0, py = 0, z = 0, ...q] = pose;
  return turned([px - x, py - y, z, ...q], -heading);
}

/** @param {Pose} pose in the frame of a body @param {ArrayLike<number>} body @returns {Pose} in the house */
export function toHouse(pose, body) {
  const [x = 0, y = 0, heading = 0] = Array.from(body);
  const [px = 0, py = 0, ...rest] = turned(pose, heading);
  return [px + x, py + y, ...rest];
}

/** Turns a pose about the vertical through the origin. @param {Pose} pose @param {number} angle rad @returns {Pose} */
function turned([x = 0, y = 0, z = 0, qw = 1, qx = 0, qy = 0, qz = 0], angle) {
  const [c, s, w, k] = [Math.cos(angle), Math.sin(angle), Math.cos(angle / 2), Math.sin(angle / 2)];
  return [c * x - s * y, s * x + c * y, z, w * qw - k * qz, w * qx - k * qy, w * qy + k * qx, w * qz + k * qw];
}

/** @param {Pose} from @param {Pose} to @param {number} share @returns {Pose} */
export function mixed(from, to, share) {
  const same = from.slice(3).reduce((sum, value, i) => sum + value * (to[i + 3] ?? 0), 0);
  const pose = from.map((value, i) => value + share * ((i >= 3 && same < 0 ? -1 : 1) * (to[i] ?? 0) - value));
  const length = Math.hypot(...pose.slice(3));
  return pose.map((value, i) => (i < 3 ? value : value / length));
}
