// World-locked markers, as mjsim draws them: mostly emitted colour, dark outlines of spheres, and x-ray ones that show
// faintly where something hides them.

import {
  BoxGeometry,
  CylinderGeometry,
  GreaterDepth,
  Group,
  KeepStencilOp,
  Matrix4,
  NotEqualStencilFunc,
  Quaternion,
  ReplaceStencilOp,
  SphereGeometry,
  Vector3,
} from "../vendor/three.js";
import { houseMaterial } from "./house_material.js";
import { Instances } from "./instances.js";

/** @import { BufferGeometry, ShaderMaterial } from "../vendor/three.js" */
/** @import { Marker } from "../protocol.js" */
/** @import { Uniforms } from "./house_material.js" */

// These are the numbers of mjsim/render/markers.py.
const CAPACITY = 1024;
const EMITTED = 0.62;
const LIT = 0.32;
const HIDDEN_OPACITY = 0.3;
const HIDDEN_GAIN = 1.3; // MuJoCo adds ambient light to a scene without lights, as that of hidden markers is
const OUTLINE = 1.4; // radius of the dark sphere behind a sphere, in radii of that
const OUTLINE_COLOUR = /** @type {const} */ ([0.03, 0.06, 0.2]);
const FIRST = 10; // in the order of drawing: after the house and what it contains
const SEEN = 1; // bit of the stencil where an x-ray marker is seen already

/** @type {Record<Marker["shape"], () => BufferGeometry>} */
const SHAPES = {
  sphere: () => new SphereGeometry(1, 16, 8).rotateX(Math.PI / 2),
  cylinder: () => new CylinderGeometry(1, 1, 2, 16).rotateX(Math.PI / 2),
  box: () => new BoxGeometry(2, 2, 2),
};
const KINDS = /** @type {const} */ (["solid", "clear", "x-ray", "hidden", "outline"]);
/** @typedef {typeof KINDS[number]} Kind */

export class Markers extends Group {
  /** @type {Map<string, Instances>} */
  #sets = new Map(); // shape and kind -> instances
  /** @type {Record<Kind, ShaderMaterial>} */
  #materials;
  #pose = new Matrix4();
  #place = new Vector3();
  #scale = new Vector3();
  #upright = new Quaternion();

  /** @param {Uniforms} light */
  constructor(light) {
    super();
    const lit = { tinted: true, shine: /** @type {[number, number, number]} */ ([0, 0, EMITTED / LIT]) };
    this.#materials = {
      solid: houseMaterial(light, lit),
      clear: houseMaterial(light, { ...lit, blend: true }),
      "x-ray": houseMaterial(light, lit),
      hidden: houseMaterial(light, { tinted: true, flat: true, blend: true }),
      outline: houseMaterial(light, { ...lit, behind: true }),
    };
    const seen = { stencilWrite: true, stencilRef: SEEN, stencilFuncMask: SEEN, stencilWriteMask: SEEN, stencilZPass: ReplaceStencilOp };
    this.#materials["x-ray"].setValues(seen);
    // Each hidden place is blended once, and none where the marker itself is seen.
    this.#materials.hidden.setValues({ ...seen, stencilFunc: NotEqualStencilFunc, stencilFail: KeepStencilOp, depthFunc: GreaterDepth });
    for (const shape of /** @type {(keyof typeof SHAPES)[]} */ (Object.keys(SHAPES))) {
      for (const kind of KINDS) {
        const set = new Instances(SHAPES[shape](), this.#materials[kind], CAPACITY);
        set.renderOrder = FIRST + KINDS.indexOf(kind);
        this.#sets.set(shape + kind, set);
        this.add(set);
      }
    }
    this.matrixAutoUpdate = false;
  }

  /** @param {Marker[]} markers */
  show(markers) {
    for (const set of this.#sets.values()) set.empty();
    for (const marker of markers) {
      const [red, green, blue, opacity] = marker.rgba;
      const clear = opacity < 0.995;
      this.#add(marker, clear ? "clear" : marker.x_ray ? "x-ray" : "solid", LIT * red, LIT * green, LIT * blue, opacity);
      if (marker.x_ray) this.#add(marker, "hidden", HIDDEN_GAIN * red, HIDDEN_GAIN * green, HIDDEN_GAIN * blue, HIDDEN_OPACITY);
      if (marker.outlined && marker.shape === "sphere") {
        const [r, g, b] = OUTLINE_COLOUR;
        this.#add(marker, "outline", LIT * r, LIT * g, LIT * b, 1, OUTLINE);
      }
    }
    for (const set of this.#sets.values()) set.send();
  }

  /**
   * @param {Marker} marker
   * @param {Kind} kind
   * @param {number} red
   * @param {number} green
   * @param {number} blue
   * @param {number} opacity
   * @param {number} [scale]
   */
  #add({ shape, position, size: [a, b, c] }, kind, red, green, blue, opacity, scale = 1) {
    if (shape === "box") this.#scale.set(a, b, c);
    else this.#scale.set(a, a, shape === "sphere" ? a : b);
    this.#scale.multiplyScalar(scale);
    this.#pose.compose(this.#place.fromArray(position), this.#upright, this.#scale);
    this.#sets.get(shape + kind)?.put(this.#pose, red, green, blue, opacity);
  }
}
