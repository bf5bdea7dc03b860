// Experimental: connects a page that draws with a headset, by WebXR. The head sets the view, the left stick walks, the
// right one turns in steps, and the other buttons press.

import { clockText } from "./hud.js";
import { upright } from "./drawing/camera.js";
import { drawPanel } from "./drawing/xr_panel.js";
import { CanvasTexture, Group, Mesh, MeshBasicMaterial, NoColorSpace, PlaneGeometry, Vector3 } from "./vendor/three.js";

/** @import { Point } from "./drawing/camera.js" */
/** @import { World3D } from "./drawing/world.js" */
/** @import { Inputs } from "./inputs.js" */
/** @import { HudState } from "./protocol.js" */
/** @typedef {"act" | "left hand" | "right hand"} Press */

const SNAP = Math.PI / 6; // rad of a step of the right stick
const DEAD = 0.15; // of a stick's way, around its middle
const PUSHED = 0.7; // of a stick's way, from where it turns
const TRIGGER = 0; // buttons of the layout `xr-standard`
const FIRST_BUTTON = 4;

export class HeadsetPage {
  #world;
  #inputs;
  #panel = Object.assign(document.createElement("canvas"), { width: 1024, height: 512 }); // what the HUD is drawn on
  #texture = new CanvasTexture(this.#panel);
  #rig = new Group(); // stands at the eye of the person, and turns with the right stick
  /** @type {XRSession | null} */
  #session = null; // null while the headset is not worn
  #heading = 0; // requested heading of the person, in radians
  #pitch = 0;
  #ahead = new Vector3();
  #turned = false; // the right stick is still pushed
  /** @type {Set<Press>} */
  #held = new Set();

  /** @param {World3D} world @param {Inputs | null} inputs of the session, or null for a recorded run */
  constructor(world, inputs) {
    this.#world = world;
    this.#inputs = inputs;
    this.#texture.colorSpace = NoColorSpace;
    const shape = new PlaneGeometry(0.7, (0.7 * this.#panel.height) / this.#panel.width);
    const mesh = new Mesh(shape, new MeshBasicMaterial({ map: this.#texture, depthTest: false, transparent: true }));
    mesh.renderOrder = 30; // over everything: walls may be nearer
    mesh.position.set(0, -0.5, -0.9); // m; below where one looks, tilted towards the eyes
    mesh.rotation.x = -0.5;
    this.#rig.add(mesh);
  }

  /**
   * Shows a button if a headset is available.
   * @param {HTMLElement} button
   * @param {() => number} heading of the person, rad
   */
  async offer(button, heading) {
    button.hidden = !(await navigator.xr?.isSessionSupported("immersive-vr"));
    button.addEventListener("click", () => this.#enter(heading()));
  }

  /** Opens the headset; call it from a click. @param {number} heading of the person, rad */
  async #enter(heading) {
    if (!navigator.xr) throw new Error("this browser has no WebXR");
    const { renderer, scene, camera } = this.#world.stage;
    const session = await navigator.xr.requestSession("immersive-vr");
    session.addEventListener("end", () => {
      this.#session = null;
      this.#rig.removeFromParent();
      camera.removeFromParent();
      renderer.xr.enabled = false;
      this.#world.resize();
      this.#inputs?.hold("headset", {});
    });
    this.#rig.rotation.y = heading - Math.PI / 2;
    camera.position.set(0, 0, 0);
    camera.rotation.set(0, 0, 0);
    scene.add(this.#rig.add(camera));
    renderer.xr.enabled = true;
    renderer.xr.setReferenceSpaceType("local");
    await renderer.xr.setSession(session);
    [this.#heading, this.#pitch, this.#turned, this.#held] = [heading, 0, false, new Set()];
    this.#session = session;
  }

  /** Places the eye, and handles head and hands. Returns false if no headset is worn. @param {Point} eye */
  place(eye) {
    const [session, inputs] = [this.#session, this.#inputs];
    if (!session) return false;
    upright(this.#rig.position, eye);
    if (!inputs) return true;
    const { x, y, z } = this.#world.stage.camera.getWorldDirection(this.#ahead); // in the last picture
    const [heading, pitch] = [Math.atan2(-z, x), Math.asin(y)];
    const turn = Math.atan2(Math.sin(heading - this.#heading), Math.cos(heading - this.#heading));
    inputs.look(turn, pitch - this.#pitch);
    [this.#heading, this.#pitch] = [heading, pitch];
    this.#takeControllers(session, inputs);
    return true;
  }

  /** @param {XRSession} session @param {Inputs} inputs */
  #takeControllers(session, inputs) {
    const held = { forward: 0, left: 0 };
    /** @type {Set<Press>} */
    const down = new Set();
    for (const { gamepad, handedness } of session.inputSources) {
      if (!gamepad) continue;
      const [, , x = 0, y = 0] = gamepad.axes.map((value) => (Math.abs(value) > DEAD ? value : 0));
      if (handedness === "left") Object.assign(held, { forward: -y, left: -x });
      else this.#snap(x);
      if (gamepad.buttons[TRIGGER]?.pressed) down.add(handedness === "left" ? "left hand" : "right hand");
      if (gamepad.buttons[FIRST_BUTTON]?.pressed) down.add("act");
    }
    inputs.hold("headset", held);
    for (const press of down) if (!this.#held.has(press)) inputs.press(press);
    this.#held = down;
  }

  /** @param {number} x of the right stick */
  #snap(x) {
    const pushed = Math.abs(x) > PUSHED;
    if (pushed && !this.#turned) this.#rig.rotation.y -= Math.sign(x) * SNAP;
    this.#turned = pushed;
  }

  /** Shows the HUD on the panel. @param {HudState} hud @param {number | null} clock s */
  show(hud, clock) {
    if (!this.#session) return;
    drawPanel(this.#panel, hud, clock === null ? "" : clockText(clock));
    this.#texture.needsUpdate = true;
  }
}
