// The person and its paths as markers, for views from outside.

/** @import { Marker } from "../protocol.js" */

const BODY = [0.85, 0.1, 0.55, 1]; // nothing in a house has this colour
const HEAD = [0.93, 0.74, 0.22, 1];
const GAP = 0.25; // m between two dots
const COLOURS = { planned: [0.84, 0.37, 0, 1], walked: [0.11, 0.11, 0.11, 1] };

/**
 * Body, head, and a nose that shows the heading.
 * @param {number} x @param {number} y @param {number} heading @param {{ eye_height: number, body_radius: number }} person
 * @returns {Marker[]}
 */
export function figure(x, y, heading, { eye_height, body_radius }) {
  const half = (eye_height - 0.25) / 2;
  const nose = [x + 0.15 * Math.cos(heading), y + 0.15 * Math.sin(heading), eye_height];
  return [
    marker("cylinder", [x, y, half], [body_radius, half, 0], BODY, true),
    marker("sphere", [x, y, eye_height], [0.14, 0, 0], HEAD),
    marker("sphere", nose, [0.06, 0, 0], BODY),
  ];
}

/**
 * Dots along a path on the floor.
 * @param {number[]} points flat, m @param {"planned" | "walked"} kind
 * @returns {Marker[]}
 */
export function dots(points, kind) {
  const found = [];
  let left = 0; // m to the next dot
  for (let i = 2; i < points.length; i += 2) {
    const [x = 0, y = 0, toX = 0, toY = 0] = points.slice(i - 2, i + 2);
    const length = Math.hypot(toX - x, toY - y);
    for (; left < length; left += GAP) {
      const share = left / length;
      const place = [x + share * (toX - x), y + share * (toY - y), kind === "planned" ? 0.05 : 0.04];
      found.push(marker("sphere", place, [kind === "planned" ? 0.05 : 0.04, 0, 0], COLOURS[kind]));
    }
    left -= length;
  }
  return found;
}

/**
 * @param {Marker["shape"]} shape @param {number[]} position @param {number[]} size @param {number[]} rgba @param {boolean} x_ray
 * @returns {Marker}
 */
function marker(shape, position, size, rgba, x_ray = false) {
  const values = { shape, position, size, rgba, role: "view", x_ray, object: null, outlined: false };
  return /** @type {Marker} */ (/** @type {unknown} */ (values));
}
