// A line around the object that the action key would take.

import {
  AlwaysStencilFunc,
  Group,
  InstancedBufferGeometry,
  KeepStencilOp,
  Mesh,
  NotEqualStencilFunc,
  ReplaceStencilOp,
  ShaderMaterial,
  Vector2,
} from "../vendor/three.js";

/** @import { Object3D } from "../vendor/three.js" */

const COLOUR = "1.0, 0.86, 0.1";
const WIDTH = 3; // CSS px
const STEPS = 12; // directions in which the silhouette is shifted
const NEARER = 0.04; // m, so that what the object stands on does not cut the line
const INSIDE = 2; // bit of the stencil where the object itself is seen

export class Outline extends Group {
  #reach = { value: new Vector2() };
  #inside = this.#material(0);
  #line = this.#material(1);
  /** @type {Object3D | null} */
  #object = null;

  constructor() {
    super();
    this.matrixAutoUpdate = false;
  }

  /** @param {number} width @param {number} height of the canvas, CSS px */
  resize(width, height) {
    this.#reach.value.set((2 * WIDTH) / width, (2 * WIDTH) / height);
  }

  /** @param {Object3D | null} object */
  around(object) {
    if (object === this.#object) return;
    this.#object = object;
    this.clear();
    object?.traverse((part) => {
      if (!(part instanceof Mesh)) return;
      const shifted = new InstancedBufferGeometry();
      shifted.setIndex(part.geometry.index);
      shifted.setAttribute("position", part.geometry.getAttribute("position"));
      shifted.instanceCount = STEPS;
      this.#add(part, part.geometry, this.#inside, 20);
      this.#add(part, shifted, this.#line, 21);
    });
  }

  /**
   * @param {Mesh} part
   * @param {Mesh["geometry"]} geometry
   * @param {ShaderMaterial} material
   * @param {number} order
   */
  #add(part, geometry, material, order) {
    const mesh = new Mesh(geometry, material);
    mesh.matrixWorld = part.matrixWorld; // the same matrix: it follows the object
    mesh.matrixWorldAutoUpdate = false;
    mesh.frustumCulled = false;
    mesh.renderOrder = order;
    this.add(mesh);
  }

  /** @param {number} shifts 0 marks where the object is, 1 draws around that */
  #material(shifts) {
    return new ShaderMaterial({
      defines: { SHIFTS: shifts, STEPS },
      uniforms: { reach: this.#reach },
      colorWrite: shifts === 1,
      depthWrite: false,
      stencilWrite: true,
      stencilRef: INSIDE,
      stencilFuncMask: INSIDE,
      stencilWriteMask: INSIDE,
      stencilFunc: shifts ? NotEqualStencilFunc : AlwaysStencilFunc,
      stencilZPass: shifts ? KeepStencilOp : ReplaceStencilOp,
      vertexShader: `
uniform vec2 reach;
void main() {
  vec4 seen = modelViewMatrix * vec4(position, 1.0);
  gl_Position = projectionMatrix * seen;
  vec4 nearer = projectionMatrix * vec4(seen.xyz * max(1.0 - ${NEARER} / length(seen.xyz), 0.5), 1.0);
  gl_Position.z = nearer.z / nearer.w * gl_Position.w;
  #if SHIFTS
  float angle = 6.2831853 * float(gl_InstanceID) / float(STEPS);
  gl_Position.xy += gl_Position.w * reach * vec2(cos(angle), sin(angle));
  #endif
}`,
      fragmentShader: `void main() { gl_FragColor = vec4(${COLOUR}, 1.0); }`,
    });
  }
}
