// The objects of an episode: each an instance of a model, with its contact shadow.

import { Group } from "../vendor/three.js";

/** @import { Object3D } from "../vendor/three.js" */
/** @import { ObjectModel } from "./scene_files.js" */
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
  #moved = true; // a shadow needs an update
  #files;
  #read;
  #shadows;

  /**
   * @param {Record<string, ObjectModel>} files
   * @param {(file: string) => Promise<Object3D>} read
   * @param {ContactShadows | null} shadows
   */
  constructor(files, read, shadows) {
    super();
    this.matrixAutoUpdate = false;
    this.#files = files;
    this.#read = read;
    this.#shadows = shadows;
  }

  /** Sets all objects, by instance. Each appears once its model is loaded. @param {Record<string, Thing>} things */
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
    const known = this.#things.has(instance);
    const object = this.object(instance) ?? new Group();
    this.#things.set(instance, { model, object });
    this.move(instance, pose);
    if (known) return;
    object.matrixAutoUpdate = false;
    this.add(object);
    object.add((await this.model(model)).clone());
    object.matrixWorldNeedsUpdate = true; // it may have been drawn without its model
  }

  /** Loads a model once. @param {string} name */
  async model(name) {
    const file = this.#files[name]?.file;
    if (!file) throw new Error(`scene.json has no object model ${name}`);
    const model = this.#models.get(name) ?? this.#read(file);
    this.#models.set(name, model);
    return model;
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

  /** Moves the shadows of moved objects. */
  update() {
    if (!this.#moved || !this.#shadows) return;
    this.#moved = false;
    this.#shadows.empty();
    for (const { model, object } of this.#things.values()) this.#shadows.under(object, this.#files[model]?.boxes ?? []);
    this.#shadows.send();
  }
}
