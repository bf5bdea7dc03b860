// Draws the house, its objects and the person with WebGL 2. Everything is in the house frame: metres, z up.

import { Group, Scene, WebGLRenderer } from "../vendor/three.js";
import { HouseCamera } from "./camera.js";
import { OUTPUT } from "./house_material.js";
import { Markers } from "./markers.js";
import { Outline } from "./outline.js";
import { dress, lightingOf, readModel, readPicture, readScene, readTexture } from "./scene_files.js";
import { ContactShadows } from "./shadows.js";
import { skyOf } from "./sky.js";
import { Things } from "./things.js";

/** @import { Object3D } from "../vendor/three.js" */
/** @import { Marker } from "../protocol.js" */
/** @import { Eye, FreeCamera, Place, Point } from "./camera.js" */
/** @import { Resolve, SceneFile } from "./scene_files.js" */
/** @import { Pose, Thing } from "./things.js" */
/**
 * @typedef {{ x: number; y: number; heading: number; hands: number[][] }} Person left and right hand in the body's frame
 * @typedef {{ calls: number; triangles: number; textures: number; milliseconds: number; renderer: string }} Info of the
 *   last frame: draw calls, triangles, textures in use, time of the main thread; and what draws
 */

/** There is no WebGL 2: the page has to show streamed frames. */
export class NoWebGL extends Error {}

export class World3D {
  /** Is called when the context is lost: nothing can be drawn any more. */
  onLost = () => {};

  #canvas;
  #renderer;
  #scene = new Scene();
  #house = new Group();
  #camera = new HouseCamera();
  #outline = new Outline();
  #milliseconds = 0;
  /** @type {Object3D[]} */
  #ceilings = [];
  #person = new Group();
  /** @type {(Object3D | undefined)[]} */
  #hands = [];
  /** @type {Things | null} */
  #things = null;
  /** @type {Markers | null} */
  #markers = null;

  /**
   * @param {HTMLCanvasElement} canvas one that has no other context
   * @throws {NoWebGL}
   */
  constructor(canvas) {
    const options = { alpha: false, antialias: true, stencil: true };
    const context = canvas.getContext("webgl2", { ...options, powerPreference: "high-performance" });
    if (!context) throw new NoWebGL("this browser has no WebGL 2");
    this.#canvas = canvas;
    this.#renderer = new WebGLRenderer({ ...options, canvas, context });
    this.#renderer.outputColorSpace = OUTPUT;
    this.#house.rotation.x = -Math.PI / 2; // three.js has y up
    this.#house.updateMatrix();
    for (const group of [this.#scene, this.#house, this.#person]) group.matrixAutoUpdate = false;
    this.#scene.add(this.#house);
    this.#house.add(this.#outline, this.#person);
    canvas.addEventListener("webglcontextlost", () => this.onLost());
  }

  /**
   * Loads the house, the person, the sky and the contact shadow. It rejects where a file cannot be read.
   * @param {Resolve} resolve URL of a file of the scene by its name
   * @returns {Promise<SceneFile>}
   */
  async load(resolve) {
    const file = await readScene(resolve);
    const spot = file.contact_shadow;
    const [house, person, sky, round] = await Promise.all([
      readModel(resolve(file.house)),
      readModel(resolve(file.person)),
      file.sky ? readPicture(resolve(file.sky)).then(skyOf) : null,
      spot ? readTexture(resolve(spot.texture)) : null,
    ]);
    const light = lightingOf(house.extras);
    for (const { group } of [house, person]) dress(group, light);
    house.group.traverse((part) => part.userData["ceiling"] && this.#ceilings.push(part));
    this.#hands = ["left_hand", "right_hand"].map((name) => person.group.getObjectByName(name));
    const shadows = spot && round ? new ContactShadows(light, spot, round) : null;
    this.#things = new Things(file.objects, resolve, light, shadows, (model) => this.#prepare(model));
    this.#markers = new Markers(light);
    this.#person.add(person.group);
    this.#house.add(house.group, this.#things, this.#markers);
    if (shadows) this.#house.add(shadows);
    if (sky) this.#scene.add(sky);
    this.#prepare(this.#scene);
    return file;
  }

  /** Compiles and uploads now, so that turning to a thing does not stutter. @param {Object3D} part */
  #prepare(part) {
    this.#renderer.compile(part, this.#camera, this.#scene);
    part.traverse((child) => {
      const map = /** @type {any} */ (child).material?.uniforms?.map?.value;
      if (map) this.#renderer.initTexture(map);
    });
  }

  /** Takes the size of the canvas on the page. @param {number} [scale] pixels of the drawing for one of the display */
  resize(scale = 1) {
    const { width, height } = this.#canvas.getBoundingClientRect();
    this.#renderer.setPixelRatio(scale * (window.devicePixelRatio || 1));
    this.#renderer.setSize(Math.max(1, width), Math.max(1, height), false);
    this.#outline.resize(Math.max(1, width), Math.max(1, height));
    this.#camera.resize(this.#canvas.width / this.#canvas.height);
  }

  /** @param {number} angle how wide the eye sees, rad, whatever the shape of the view */
  setFieldOfView(angle) {
    this.#camera.horizontal = angle;
    this.#camera.resize(this.#camera.aspect);
  }

  /** Looks through the person's eyes. @param {Eye} eye */
  setEye(eye) {
    this.#camera.setEye(eye);
  }

  /** Looks from anywhere. @param {FreeCamera} camera */
  setCamera(camera) {
    this.#camera.setFree(camera);
  }

  /**
   * Where a point appears.
   * @param {Point} point
   * @returns {Readonly<Place>} the same value at every call
   */
  project(point) {
    return this.#camera.locate(point);
  }

  /** @param {boolean} shown what hangs above the rooms, as a view from above must not */
  showCeilings(shown) {
    for (const part of this.#ceilings) part.visible = shown;
  }

  /**
   * What there is, by instance. An object shows as soon as its model is loaded; resolves when all are.
   * @param {Record<string, Thing>} things
   */
  async setObjects(things) {
    await this.#things?.set(things);
  }

  /** Loads models of objects ahead of time. @param {string[]} models */
  async loadModels(models) {
    await Promise.all(models.map((model) => this.#things?.read(model)));
  }

  /** @param {string} instance @param {Pose} pose */
  setPose(instance, pose) {
    this.#things?.move(instance, pose);
  }

  /** @param {Person} person */
  setPerson({ x, y, heading, hands }) {
    this.#person.position.set(x, y, 0);
    this.#person.rotation.z = heading;
    this.#person.updateMatrix();
    this.#person.matrixWorldNeedsUpdate = true;
    for (let side = 0; side < 2; side++) {
      const hand = this.#hands[side];
      const place = hands[side];
      if (place) hand?.position.fromArray(place);
      hand?.updateMatrix();
    }
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
    this.#renderer.render(this.#scene, this.#camera);
    this.#milliseconds = performance.now() - start;
  }

  /** @returns {Info} */
  info() {
    const { render, memory } = this.#renderer.info;
    const gl = this.#renderer.getContext();
    const names = gl.getExtension("WEBGL_debug_renderer_info");
    const renderer = String(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
    return { calls: render.calls, triangles: render.triangles, textures: memory.textures, milliseconds: this.#milliseconds, renderer };
  }

  /** Frees what the graphics card holds. */
  close() {
    this.#renderer.dispose();
  }
}
