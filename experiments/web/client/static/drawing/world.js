// Draws the house, its objects and the person with WebGL 2. Everything is in the house frame: metres, z up.

import { Group, LinearSRGBColorSpace, Scene, WebGLRenderer } from "../vendor/three.js";
import { Arm } from "./arms.js";
import { HouseCamera } from "./camera.js";
import { lighting } from "./house_material.js";
import { Markers } from "./markers.js";
import { Outline } from "./outline.js";
import { dress, readModel, readPicture, readScene, readTexture } from "./scene_files.js";
import { ContactShadows } from "./shadows.js";
import { skyOf } from "./sky.js";
import { Things } from "./things.js";

/** @import { Object3D } from "../vendor/three.js" */
/** @import { Marker } from "../protocol.js" */
/** @import { Resolve, SceneFile } from "./scene_files.js" */
/** @import { Pose, Thing } from "./things.js" */
/**
 * @typedef {{ x: number; y: number; heading: number; hands: number[][]; eyeHeight?: number }} Person left and right hand
 *   in the body's frame
 * @typedef {{ calls: number; triangles: number; textures: number; milliseconds: number; renderer: string }} Info of the
 *   last frame: draw calls, triangles, textures in use, time of the main thread; and what draws
 */

export class World3D {
  /** Is called when the context is lost, so that nothing can be drawn. */
  onLost = () => {};
  /** Is called when a lost context is back. */
  onRestored = () => {};
  camera = new HouseCamera();

  #canvas;
  #renderer;
  #scene = new Scene();
  #house = new Group();
  #outline = new Outline();
  #person = new Group();
  #milliseconds = 0;
  /** @type {Object3D[]} */
  #ceilings = [];
  /** @type {Arm[]} */
  #arms = [];
  /** @type {Things | null} */
  #things = null;
  /** @type {Markers | null} */
  #markers = null;

  /** @param {HTMLCanvasElement} canvas one that has no other context @throws {Error} where there is no WebGL 2: the page has to show streamed frames */
  constructor(canvas) {
    const options = { alpha: false, antialias: true, stencil: true };
    const context = canvas.getContext("webgl2", { ...options, powerPreference: "high-performance" });
    if (!context) throw new Error("this browser has no WebGL 2");
    this.#canvas = canvas;
    this.#renderer = new WebGLRenderer({ ...options, canvas, context });
    this.#renderer.outputColorSpace = LinearSRGBColorSpace; // shaders give colours as the display takes them
    this.#house.rotation.x = -Math.PI / 2; // three.js has y up
    this.#house.updateMatrix();
    for (const group of [this.#scene, this.#house, this.#person]) group.matrixAutoUpdate = false;
    canvas.addEventListener("webglcontextlost", () => this.onLost());
    canvas.addEventListener("webglcontextrestored", () => this.onRestored());
  }

  /** Loads all but the models of objects; rejects where a file cannot be read. @param {Resolve} resolve @returns {Promise<SceneFile>} */
  async load(resolve) {
    const file = await readScene(resolve("scene.json"));
    for (const group of [this.#scene, this.#house, this.#person]) group.clear(); // of another house
    this.#house.add(this.#outline, this.#person);
    const spot = file.contact_shadow;
    const [house, person, sky, round] = await Promise.all([
      readModel(resolve(file.house)),
      readModel(resolve(file.person)),
      file.sky ? readPicture(resolve(file.sky)).then(skyOf) : null,
      spot ? readTexture(resolve(spot.texture)) : null,
    ]);
    const light = lighting(house.extras["lights"] ?? [], house.extras["headlight"]);
    for (const { group } of [house, person]) dress(group, light);
    this.#ceilings = [];
    house.group.traverse((part) => part.userData["ceiling"] && this.#ceilings.push(part));
    this.#arms = ["left", "right"].flatMap((side) => {
      const [hand, sleeve] = ["hand", "sleeve"].map((name) => person.group.getObjectByName(`${side}_${name}`));
      return hand && sleeve ? [new Arm(hand, sleeve, /** @type {any} */ (hand.userData["arm"]))] : [];
    });
    const shadows = spot && round ? new ContactShadows(light, spot, round) : null;
    const read = async (/** @type {string} */ name) => {
      const { group } = await readModel(resolve(name));
      dress(group, light);
      return this.#prepared(group);
    };
    this.#things = new Things(file.objects, read, shadows);
    this.#markers = new Markers(light);
    this.#person.add(person.group);
    this.#house.add(house.group, this.#things, this.#markers);
    if (shadows) this.#house.add(shadows);
    if (sky) this.#scene.add(sky);
    this.#outline.around(person.group); // so that it is prepared, too
    this.#scene.add(this.#house);
    await this.#prepared(this.#scene);
    this.#outline.around(null);
    return file;
  }

  /** Compiles shaders and uploads textures now, so that turning to a part does not stutter. @template {Object3D} T @param {T} part */
  async #prepared(part) {
    await this.#renderer.compileAsync(part, this.camera);
    part.traverse((child) => {
      const map = /** @type {any} */ (child).material?.uniforms?.map?.value;
      if (map) this.#renderer.initTexture(map);
    });
    return part;
  }

  /** Takes the size of the canvas on the page. @param {number} [scale] pixels of the drawing for one of the display */
  resize(scale = 1) {
    const { width, height } = this.#canvas.getBoundingClientRect();
    this.#renderer.setPixelRatio(scale * (window.devicePixelRatio || 1));
    this.#renderer.setSize(Math.max(1, width), Math.max(1, height), false);
    this.#outline.resize(Math.max(1, width), Math.max(1, height));
    this.camera.resize(this.#canvas.width / this.#canvas.height);
  }

  /** @param {number} angle how wide the eye sees, rad, whatever the shape of the view */
  setFieldOfView(angle) {
    this.camera.horizontal = angle;
    this.camera.resize(this.camera.aspect);
  }

  /** @param {boolean} shown what hangs above the rooms, which hides them from above */
  showCeilings(shown) {
    for (const part of this.#ceilings) part.visible = shown;
  }

  /** What there is, by instance; an object shows as soon as its model is loaded. @param {Record<string, Thing>} things */
  async setObjects(things) {
    await this.#things?.set(things);
  }

  /** Loads models of objects ahead of time. @param {string[]} models */
  async loadModels(models) {
    await Promise.all(models.map((model) => this.#things?.model(model)));
  }

  /** @param {string} instance @param {Pose} pose */
  setPose(instance, pose) {
    this.#things?.move(instance, pose);
  }

  /** @param {Person} person */
  setPerson({ x, y, heading, hands, eyeHeight }) {
    this.#person.position.set(x, y, 0);
    this.#person.rotation.z = heading;
    this.#person.updateMatrix();
    this.#person.matrixWorldNeedsUpdate = true;
    for (const [side, arm] of this.#arms.entries()) arm.pose(hands[side] ?? [0, 0, 0], eyeHeight);
  }

  /** @param {Marker[]} markers */
  setMarkers(markers) {
    this.#markers?.show(markers);
  }

  /** Outlines one object. @param {string | null} instance */
  setOutline(instance) {
    this.#outline.around(this.#things?.object(instance) ?? null);
  }

  draw() {
    const start = performance.now();
    this.#things?.update();
    this.#renderer.render(this.#scene, this.camera);
    this.#milliseconds = performance.now() - start;
  }

  /** @returns {Info} */
  info() {
    const { render: { calls, triangles }, memory: { textures } } = this.#renderer.info;
    const gl = this.#renderer.getContext();
    const names = gl.getExtension("WEBGL_debug_renderer_info");
    const renderer = String(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
    return { calls, triangles, textures, milliseconds: this.#milliseconds, renderer };
  }

  /** Calls a function for every picture, of the page or of the headset that is worn. @param {(now: number) => void} frame takes ms */
  onFrame(frame) {
    this.#renderer.setAnimationLoop((now, xr) => frame(xr ? performance.now() : now));
  }

  /** What a headset draws with. */
  get stage() {
    return { renderer: this.#renderer, scene: this.#scene, camera: this.camera };
  }
}
