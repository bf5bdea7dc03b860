// The objects of an episode: each an instance of a model, with its contact shadow.

import { Group } from "../vendor/three.js";
import { dress, readModel } from "./scene_files.js";

/** @import { Object3D } from "../vendor/three.js" */
/** @import { Uniforms } from "./house_material.js" */
/** @import { ObjectModel, Resolve } from "./scene_files.js" */
/** @import { ContactShadows } from "./shadows.js" */
/**
 * @typedef {ArrayLike<number>} Pose position, m, and turn as a unit quaternion (w, x, y, z)
 * @typedef {{ model: string; pose: Pose }} Thing an object: its model and where it lies
 */

export class Things extends Group {
  /** @type {Map<string, Promise<Object3D>>} */
  #models = new Map(); // by name
  /** @type {Map<string, { model: string; object: Group }>} */
  #things = new Map(); // by instance
  #moved = true; // a shadow has to follow
  #files;
  #resolve;
  #light;
  #shadows;
  #loaded;

  /**
   * @param {Record<string, ObjectModel>} files
   * @param {Resolve} resolve
   * @param {Uniforms} light
   * @param {ContactShadows | null} shadows
   * @param {(model: Object3D) => void} loaded is called with every model
   */
  constructor(files, resolve, light, shadows, loaded) {
    super();
    this.#files = files;
    this.#resolve = resolve;
    this.#light = light;
    this.#shadows = shadows;
    this.#loaded = loaded;
    this.matrixAutoUpdate = false;
  }

  /**
   * What there is; an object shows as soon as its model is loaded.
   * @param {Record<string, Thing>} things by instance
   */
  async set(things) {
    for (const [instance, { model, object }] of this.#things) {
      if (things[instance]?.model === model) continue;
      object.removeFromParent();
      this.#things.delete(instance);
      this.#moved = true;
    }
    await Promise.all(Object.entries(things).map(([instance, thing]) => this.#put(instance, thing)));
  }

  /** @param {string} instance @param {Thing} thing */
  async #put(instance, { model, pose }) {
    if (!this.#things.has(instance)) {
      const object = new Group();
      object.matrixAutoUpdate = false;
      this.add(object);
      this.#things.set(instance, { model, object });
      this.move(instance, pose);
      object.add((await this.read(model)).clone());
    } else this.move(instance, pose);
  }

  /** Reads a model; each is read once. @param {string} name */
  read(name) {
    let model = this.#models.get(name);
    if (!model) this.#models.set(name, (model = this.#read(name)));
    return model;
  }

  /** @param {string} name */
  async #read(name) {
    const file = this.#files[name]?.file;
    if (!file) throw new Error(`scene.json has no object model ${name}`);
    const { group } = await readModel(this.#resolve(file));
    dress(group, this.#light);
    this.#loaded(group);
    return group;
  }

  /** @param {string} instance @param {Pose} pose */
  move(instance, pose) {
    const object = this.object(instance);
    if (!object) return;
    const [x = 0, y = 0, z = 0, qw = 1, qx = 0, qy = 0, qz = 0] = /** @type {number[]} */ (pose);
    object.position.set(x, y, z);
    object.quaternion.set(qx, qy, qz, qw);
    object.updateMatrix();
    object.matrixWorldNeedsUpdate = true;
    this.#moved = true;
  }

  /** @param {string | null} instance */
  object(instance) {
    return this.#things.get(instance ?? "")?.object ?? null;
  }

  /** Puts the shadows under what moved. */
  update() {
    if (!this.#moved || !this.#shadows) return;
    this.#moved = false;
    this.#shadows.empty();
    for (const { model, object } of this.#things.values()) {
      this.#shadows.under(object, this.#files[model]?.boxes ?? []);
    }
    this.#shadows.send();
  }
}
