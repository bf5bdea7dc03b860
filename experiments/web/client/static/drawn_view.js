// The view drawn by this browser: the scene, the predicted walk, and the server's state of everything else.

/** @import { HeadsetPage } from "./headset.js" */
/** @import { Thing } from "./drawing/things.js" */
/** @import { Input, Moment, SceneMessage, Snapshot } from "./protocol.js" */

import { World3D } from "./drawing/world.js";
import { X, Y, eyeOf } from "./prediction/body.js";
import { Poses } from "./prediction/poses.js";
import { Predictor } from "./prediction/predictor.js";
import { Walker } from "./prediction/walking.js";
import { MAX_STEPS_AHEAD } from "./protocol.js";

const MAX_LATE = 1000; // delay after which control steps are skipped because the page was suspended, in ms
const SNAP = Math.PI / 8; // turning step with less motion, in radians

/** @typedef {{ body: ArrayLike<number>, moving: boolean, reach: [number, number] | null }} Drawn the drawn body, whether it moves, and the position in the view of the object in reach, as shares */

export class DrawnView {
  calm = false;
  /** @type {HeadsetPage | null} */
  headset = null;
  world;
  #flush;
  #house = { path: "", loaded: Promise.resolve() };
  /** @type {SceneMessage | null} */
  #scene = null;
  /** @type {Walker | null} */
  #walker = null;
  /** @type {Predictor | null} */
  #predictor = null;
  #poses = new Poses();
  /** @type {Record<string, Thing>} */
  #things = {};
  /** @type {Snapshot | null} */
  #newest = null;
  /** @type {Moment["reach"]} */
  #reach = null;
  #due = 0; // end of the next control step, in ms; 0 while the clock is stopped
  #body = new Float64Array(4); // the body on show

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {(until: number) => void} flush is called when a control step is over
   */
  constructor(canvas, flush) {
    this.world = new World3D(canvas);
    this.#flush = flush;
  }

  /** Heading of the view, in radians. */
  get heading() {
    return this.#body[2] ?? 0;
  }

  /** Preloads a house. `load` reports any error later. @param {string} path */
  prepare(path) {
    const before = this.#house.loaded.catch(() => {});
    const load = async () => {
      const { objects } = await this.world.load((name) => path + name);
      this.world.loadModels(Object.keys(objects)); // ahead of the moment when they come into view
    };
    this.#house = { path, loaded: before.then(load) };
    this.#house.loaded.catch(() => {});
  }

  /** Loads a house, unless it is loaded or loading, as after a reconnect or resize. @param {SceneMessage} message */
  async load(message) {
    const { path } = message;
    if (path === null) throw new Error("the server has no files of it");
    if (this.#scene) this.world.setObjects((this.#things = {})); // the server sends all known objects again
    if (this.#house.path !== path) this.prepare(path);
    await this.#house.loaded;
    const floor = message.floor === null ? null : await fetch(message.floor);
    if (floor && !floor.ok) throw new Error(`${message.floor}: ${floor.status}`);
    this.#walker = floor && new Walker(message.gait, await floor.json());
    this.world.setFieldOfView(message.field_of_view);
    this.#scene = message;
  }

  /** Starts the clock. @param {number} now ms */
  begin(now) {
    this.#due = now + 1000 * this.#duration;
    this.#predictor = null;
  }

  /** Stops the clock and the prediction. */
  end() {
    this.#due = 0;
    this.#predictor = null;
  }

  /** Control step in which a new input takes effect, or null while the clock is stopped. */
  get step() {
    return this.#predictor?.step ?? null;
  }

  /** @param {Input} input */
  add(input) {
    this.#predictor?.add(input);
  }

  /** @param {Snapshot} state @param {number} now ms */
  take(state, now) {
    const scene = this.#scene;
    if (!scene) return;
    this.#newest = state;
    if (this.#predictor) this.#predictor.correct(state.step, state.body, state.busy);
    else if (this.#due) {
      this.#predictor = new Predictor(this.#walker, scene.speeds, scene.gait.dt, state.step, state.body);
      this.tick(now);
    }
    for (const name of state.gone) delete this.#things[name];
    for (const [name, model] of Object.entries(state.models)) this.#things[name] = { model, pose: state.objects[name] ?? [] };
    if (state.gone.length || Object.keys(state.models).length) this.world.setObjects(this.#things);
    this.#poses.take(state, now / 1000, this.#body);
  }

  /** @param {Moment["reach"]} reach */
  outline(reach) {
    this.#reach = reach;
    this.world.setOutline(reach?.instance ?? null);
  }

  /** Takes all due control steps that the server would accept. @param {number} now ms */
  tick(now) {
    const predictor = this.#predictor;
    if (!predictor) return;
    if (now - this.#due > MAX_LATE) this.#due = now;
    const last = (this.#newest?.step ?? 0) + MAX_STEPS_AHEAD;
    for (; this.#due <= now; this.#due += 1000 * this.#duration) {
      if (predictor.step >= last) {
        this.#due = now;
        return;
      }
      predictor.advance();
      this.#flush(predictor.step);
    }
  }

  /** Draws. @param {number} now ms @returns {Drawn | null} */
  draw(now) {
    const [scene, state, predictor] = [this.#scene, this.#newest, this.#predictor];
    if (!scene || !state) return null;
    const share = Math.min(1, Math.max(0, 1 - (this.#due - now) / (1000 * this.#duration)));
    const body = predictor ? predictor.drawn(share) : state.body;
    const moving = Math.hypot((body[X] ?? 0) - (this.#body[X] ?? 0), (body[Y] ?? 0) - (this.#body[Y] ?? 0)) > 1e-3;
    for (let i = 0; i < 4; i++) this.#body[i] = body[i] ?? 0;
    const [x = 0, y = 0, heading = 0] = this.#body;
    for (const name of this.#poses.names()) {
      const pose = this.#poses.at(name, now / 1000, this.#body);
      if (pose) this.world.setPose(name, pose);
    }
    this.world.setPerson({ x, y, heading, hands: state.hands, eyeHeight: scene.gait.eye_height });
    const eye = eyeOf(this.#body, scene.gait);
    if (this.calm) eye.heading = SNAP * Math.round(heading / SNAP);
    if (!this.headset?.place(eye.position)) this.world.camera.setEye(eye);
    this.world.draw();
    return { body: this.#body, moving, reach: this.#reachAt() };
  }

  /** @returns {[number, number] | null} */
  #reachAt() {
    const place = this.#reach?.place;
    const at = place && this.world.camera.locate(place);
    return at?.inView ? [at.x, at.y] : null;
  }

  get #duration() {
    return this.#scene?.gait.dt ?? 0.04;
  }
}
