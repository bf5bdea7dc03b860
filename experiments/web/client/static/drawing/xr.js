// Experimental: the house in a headset, by WebXR. The head looks, the left stick walks, the right one turns in steps.

import { CanvasTexture, Group, Mesh, MeshBasicMaterial, NoColorSpace, PlaneGeometry, Vector3 } from "../vendor/three.js";
import { upright } from "./camera.js";

/** @import { Point } from "./camera.js" */
/** @import { World3D } from "./world.js" */
/** @typedef {"act" | "left hand" | "right hand"} Press */

const SNAP = Math.PI / 6; // rad of a step of the right stick
const DEAD = 0.15; // of a stick's way, around its middle
const PUSHED = 0.7; // of a stick's way, from where it turns
const TRIGGER = 0; // buttons of the layout `xr-standard`
const FIRST_BUTTON = 4;

/** Whether this browser has a headset. */
export async function hasHeadset() {
  return Boolean(await navigator.xr?.isSessionSupported("immersive-vr"));
}

export class Headset {
  #world;
  #rig = new Group(); // stands at the eye of the person, and turns with the right stick
  #texture;
  /** @type {XRSession | null} */
  #session = null;
  #ahead = new Vector3();
  #turned = false; // the right stick is still pushed
  /** @type {Set<Press>} */
  #held = new Set();

  /** @param {World3D} world @param {HTMLCanvasElement} panel what the HUD is drawn on */
  constructor(world, panel) {
    this.#world = world;
    this.#texture = new CanvasTexture(panel);
    this.#texture.colorSpace = NoColorSpace;
    const shape = new PlaneGeometry(0.7, (0.7 * panel.height) / panel.width);
    const mesh = new Mesh(shape, new MeshBasicMaterial({ map: this.#texture, depthTest: false, transparent: true }));
    mesh.renderOrder = 30; // over everything: walls may be nearer
    mesh.position.set(0, -0.5, -0.9); // m; below where one looks, tilted towards the eyes
    mesh.rotation.x = -0.5;
    this.#rig.add(mesh);
  }

  /**
   * Opens the headset; call it from a click.
   * @param {number} heading of the person, rad
   * @param {() => void} ended
   */
  async enter(heading, ended) {
    if (!navigator.xr) throw new Error("this browser has no WebXR");
    const { renderer, scene, camera } = this.#world.stage;
    const session = await navigator.xr.requestSession("immersive-vr");
    this.#session = session;
    session.addEventListener("end", () => {
      this.#session = null;
      this.#rig.removeFromParent();
      camera.removeFromParent();
      renderer.xr.enabled = false;
      this.#world.resize();
      ended();
    });
    this.#rig.rotation.y = heading - Math.PI / 2;
    camera.position.set(0, 0, 0);
    camera.rotation.set(0, 0, 0);
    scene.add(this.#rig.add(camera));
    renderer.xr.enabled = true;
    renderer.xr.setReferenceSpaceType("local");
    await renderer.xr.setSession(session);
  }

  /** Puts the person's eye somewhere. @param {Point} eye */
  place(eye) {
    upright(this.#rig.position, eye);
  }

  /** Where the head looked in the last picture, rad. */
  look() {
    const { x, y, z } = this.#world.stage.camera.getWorldDirection(this.#ahead);
    return { heading: Math.atan2(-z, x), pitch: Math.asin(y) };
  }

  /** Shows the panel as it is drawn now. */
  refresh() {
    this.#texture.needsUpdate = true;
  }

  /** Takes the controllers: what the left stick holds, from -1 to 1, and what was pressed since. */
  controls() {
    const held = { forward: 0, left: 0 };
    /** @type {Set<Press>} */
    const down = new Set();
    for (const { gamepad, handedness } of this.#session?.inputSources ?? []) {
      if (!gamepad) continue;
      const [, , x = 0, y = 0] = gamepad.axes.map((value) => (Math.abs(value) > DEAD ? value : 0));
      if (handedness === "left") Object.assign(held, { forward: -y, left: -x });
      else this.#snap(x);
      if (gamepad.buttons[TRIGGER]?.pressed) down.add(handedness === "left" ? "left hand" : "right hand");
      if (gamepad.buttons[FIRST_BUTTON]?.pressed) down.add("act");
    }
    const pressed = [...down].filter((press) => !this.#held.has(press));
    this.#held = down;
    return { ...held, pressed };
  }

  /** @param {number} x of the right stick */
  #snap(x) {
    const pushed = Math.abs(x) > PUSHED;
    if (pushed && !this.#turned) this.#rig.rotation.y -= Math.sign(x) * SNAP;
    this.#turned = pushed;
  }
}
