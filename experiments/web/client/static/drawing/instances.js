// Many things of one shape, each with its own pose and colour, in one draw.

import { DynamicDrawUsage, InstancedBufferAttribute, InstancedMesh, Sphere } from "../vendor/three.js";

/** @import { BufferGeometry, Material, Matrix4 } from "../vendor/three.js" */

/** @extends {InstancedMesh<BufferGeometry, Material>} */
export class Instances extends InstancedMesh {
  #tint;

  /** @param {BufferGeometry} geometry @param {Material} material @param {number} capacity */
  constructor(geometry, material, capacity) {
    super(geometry, material, capacity);
    this.#tint = new InstancedBufferAttribute(new Float32Array(4 * capacity), 4);
    geometry.setAttribute("tint", this.#tint);
    for (const attribute of [this.instanceMatrix, this.#tint]) attribute.setUsage(DynamicDrawUsage);
    this.matrixAutoUpdate = false;
    this.frustumCulled = false;
    this.boundingSphere = new Sphere(); // otherwise three.js computes an unused one
    this.empty();
  }

  empty() {
    this.count = 0;
    this.visible = false;
  }

  /** Adds an instance, unless the capacity is reached. @param {Matrix4} pose @param {number} red @param {number} green @param {number} blue @param {number} opacity */
  put(pose, red, green, blue, opacity) {
    if (this.count === this.instanceMatrix.count) return;
    this.setMatrixAt(this.count, pose);
    this.#tint.setXYZW(this.count, red, green, blue, opacity);
    this.count += 1;
    this.visible = true;
  }

  /** Uploads the added instances. */
  send() {
    for (const attribute of [this.instanceMatrix, this.#tint]) {
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, this.count * attribute.itemSize);
      attribute.needsUpdate = this.visible;
    }
  }
}
