// World-locked markers, as mjsim draws them: mostly emitted colour, dark outlines of spheres, and x-ray ones that show
// faintly where something hides them.

import { BoxGeometry, CylinderGeometry, Group, Matrix4, Quaternion, SphereGeometry, Vector3 } from "../vendor/three.js";
import { GreaterDepth, NotEqualStencilFunc, ReplaceStencilOp } from "../vendor/three.js";
import { houseMaterial } from "./house_material.js";
import { Instances } from "./instances.js";

/** @import { Marker } from "../protocol.js" */
/** @import { Uniforms } from "./house_material.js" */
/** @typedef {"solid" | "clear" | "x-ray" | "hidden" | "outline" | "inner line" | "outer line"} Kind */

// The numbers of mjsim/render/markers.py.
const CAPACITY = 1024;
const EMITTED = 0.62;
const LIT = 0.32;
const HIDDEN_OPACITY = 0.3;
const OUTLINE = 1.4; // radius of the dark sphere behind a sphere, in radii of that
const OUTLINE_RGBA = [0.03, 0.06, 0.2, 1];
// Lines around an x-ray marker that something hides, from the inside to the outside: colour, and share of the picture's
// height. Every colour has a contrast of at least 3 : 1 to one of the two tones.
/** @type {[Kind, number[]][]} */
export const LINES = [["inner line", [8 / 255, 15 / 255, 51 / 255, 1]], ["outer line", [242 / 255, 242 / 255, 242 / 255, 1]]];
const LINE_WIDTH = 0.0025;
const FIRST = 10; // in the order of drawing: after the house and what it contains
const SEEN = 1; // bit of the stencil where an x-ray marker is seen already

export class Markers extends Group {
  /** @type {Map<string, Instances>} */
  #sets = new Map(); // shape and kind -> instances
  #pose = new Matrix4();
  #place = new Vector3();
  #scale = new Vector3();
  #upright = new Quaternion();

  /** @param {Uniforms} light */
  constructor(light) {
    super();
    this.matrixAutoUpdate = false;
    const lit = { tinted: true, shine: [0, 0, EMITTED / LIT] };
    const materials = {
      solid: houseMaterial(light, lit),
      clear: houseMaterial(light, { ...lit, blend: true }),
      "x-ray": houseMaterial(light, lit),
      hidden: houseMaterial(light, { tinted: true, flat: true }),
      outline: houseMaterial(light, { ...lit, behind: true }),
      "inner line": houseMaterial(light, { tinted: true, flat: true, grown: LINE_WIDTH }),
      "outer line": houseMaterial(light, { tinted: true, flat: true, grown: 2 * LINE_WIDTH }),
    };
    const seen = { stencilWrite: true, stencilRef: SEEN, stencilFuncMask: SEEN, stencilWriteMask: SEEN, stencilZPass: ReplaceStencilOp };
    materials["x-ray"].setValues(seen);
    // Each hidden place is blended once, and none where the marker itself is seen.
    const behind = { transparent: true, depthWrite: false, depthFunc: GreaterDepth, stencilFunc: NotEqualStencilFunc };
    for (const kind of /** @type {const} */ (["hidden", "inner line", "outer line"])) materials[kind].setValues({ ...seen, ...behind });
    const shapes = {
      sphere: new SphereGeometry(1, 16, 8).rotateX(Math.PI / 2),
      cylinder: new CylinderGeometry(1, 1, 2, 16).rotateX(Math.PI / 2),
      box: new BoxGeometry(2, 2, 2),
    };
    for (const [shape, geometry] of Object.entries(shapes)) {
      for (const [order, [kind, material]] of Object.entries(materials).entries()) {
        const set = new Instances(geometry.clone(), material, CAPACITY);
        set.renderOrder = FIRST + order;
        this.#sets.set(shape + kind, set);
        this.add(set);
      }
    }
  }

  /** @param {Marker[]} markers */
  show(markers) {
    for (const set of this.#sets.values()) set.empty();
    for (const marker of markers) {
      this.#put(marker, marker.rgba[3] < 0.995 ? "clear" : marker.x_ray ? "x-ray" : "solid", marker.rgba, LIT);
      if (marker.x_ray) {
        this.#put(marker, "hidden", marker.rgba, 1, HIDDEN_OPACITY);
        for (const [kind, rgba] of LINES) this.#put(marker, kind, rgba, 1);
      }
      if (marker.outlined && marker.shape === "sphere") this.#put(marker, "outline", OUTLINE_RGBA, LIT, 1, OUTLINE);
    }
    for (const set of this.#sets.values()) set.send();
  }

  /** @param {Marker} marker @param {Kind} kind @param {number[]} rgba @param {number} gain @param {number} [opacity] @param {number} [size] */
  #put({ shape, position, size: [a, b, c] }, kind, [red = 0, green = 0, blue = 0, alpha = 1], gain, opacity = alpha, size = 1) {
    if (shape === "box") this.#scale.set(a, b, c);
    else this.#scale.set(a, a, shape === "sphere" ? a : b);
    this.#pose.compose(this.#place.fromArray(position), this.#upright, this.#scale.multiplyScalar(size));
    this.#sets.get(shape + kind)?.put(this.#pose, gain * red, gain * green, gain * blue, opacity);
  }
}
