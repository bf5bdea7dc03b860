// A line around the object in reach of the action key, yellow with dark edges, visible on any background.

import { Group, InstancedBufferGeometry, Mesh, ShaderMaterial, Vector2, Vector3 } from "../vendor/three.js";
import { AlwaysStencilFunc, KeepStencilOp, NotEqualStencilFunc, ReplaceStencilOp } from "../vendor/three.js";

/** @import { BufferGeometry, Object3D } from "../vendor/three.js" */

// Passes one after another: where the object is, and two lines outside of that. Widths in CSS px.
const PASSES = [{ width: 0, colour: [0, 0, 0] }, { width: 4, colour: [0.03, 0.06, 0.2] }, { width: 2.5, colour: [1, 0.86, 0.1] }];
const STEPS = 12; // number of directions in which the silhouette is shifted
const NEARER = 0.04; // m, so that what the object stands on does not cut the line
const INSIDE = 2; // bit of the stencil where the object itself is seen
const FIRST = 20; // in the order of drawing: after contact shadows and markers

export class Outline extends Group {
  #materials = PASSES.map(({ width, colour }) => material(width > 0, colour));
  /** @type {Object3D | null} */
  #object = null;
  /** @type {Map<BufferGeometry, BufferGeometry>} */
  #shifted = new Map(); // of a part -> many times, to be shifted

  constructor() {
    super();
    this.matrixAutoUpdate = false;
  }

  /** @param {number} width @param {number} height of the canvas, CSS px */
  resize(width, height) {
    for (const [pass, { uniforms }] of this.#materials.entries()) {
      const reach = PASSES[pass]?.width ?? 0;
      uniforms["reach"]?.value.set((2 * reach) / width, (2 * reach) / height);
    }
  }

  /** @param {Object3D | null} object */
  around(object) {
    if (object === this.#object) return;
    this.#object = object?.children.length ? object : null; // its model may still be on the way
    this.clear();
    object?.traverse((part) => {
      if (!(part instanceof Mesh)) return;
      for (const [pass, look] of this.#materials.entries()) {
        const mesh = new Mesh(pass ? this.#many(part.geometry) : part.geometry, look);
        mesh.matrixWorld = part.matrixWorld; // the same matrix: it follows the object
        mesh.matrixWorldAutoUpdate = false;
        mesh.frustumCulled = false;
        mesh.renderOrder = FIRST + pass;
        this.add(mesh);
      }
    });
  }

  /** @param {BufferGeometry} geometry */
  #many(geometry) {
    const known = this.#shifted.get(geometry);
    if (known) return known;
    const shifted = new InstancedBufferGeometry();
    shifted.setIndex(geometry.index);
    shifted.setAttribute("position", geometry.getAttribute("position"));
    shifted.instanceCount = STEPS;
    this.#shifted.set(geometry, shifted);
    return shifted;
  }
}

/** @param {boolean} line whether it draws around the object instead of marking where that is @param {number[]} colour */
function material(line, colour) {
  return new ShaderMaterial({
    defines: { STEPS },
    uniforms: { reach: { value: new Vector2() }, colour: { value: new Vector3(...colour) } },
    transparent: true, // drawn after what is opaque
    colorWrite: line,
    depthWrite: false,
    stencilWrite: true,
    stencilRef: INSIDE,
    stencilFuncMask: INSIDE,
    stencilWriteMask: INSIDE,
    stencilFunc: line ? NotEqualStencilFunc : AlwaysStencilFunc,
    stencilZPass: line ? KeepStencilOp : ReplaceStencilOp,
    vertexShader: `
uniform vec2 reach;
void main() {
  vec4 seen = modelViewMatrix * vec4(position, 1.0);
  vec4 nearer = projectionMatrix * vec4(seen.xyz * max(1.0 - ${NEARER} / length(seen.xyz), 0.5), 1.0);
  gl_Position = projectionMatrix * seen;
  gl_Position.z = nearer.z / nearer.w * gl_Position.w;
  float angle = 6.2831853 * float(gl_InstanceID) / float(STEPS);
  gl_Position.xy += gl_Position.w * reach * vec2(cos(angle), sin(angle));
}`,
    fragmentShader: `
uniform vec3 colour;
void main() { gl_FragColor = vec4(colour, 1.0); }`,
  });
}
