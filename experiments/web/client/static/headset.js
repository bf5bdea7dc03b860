// Experimental: connects a page that draws with a headset. The head sets the view, and controllers walk and press.

/** @import { Point } from "./drawing/camera.js" */
/** @import { World3D } from "./drawing/world.js" */
/** @import { Inputs } from "./inputs.js" */
/** @import { HudState } from "./protocol.js" */

import { clockText } from "./hud.js";
import { drawPanel } from "./drawing/xr_panel.js";
import { Headset, hasHeadset } from "./drawing/xr.js";

export class HeadsetPage {
  #world;
  #inputs;
  #panel = Object.assign(document.createElement("canvas"), { width: 1024, height: 512 });
  /** @type {Headset | null} */
  #headset = null; // null while it is not worn
  #heading = 0; // requested heading of the person, in radians
  #pitch = 0;

  /** @param {World3D} world @param {Inputs | null} inputs of the session, or null for a recorded run */
  constructor(world, inputs) {
    this.#world = world;
    this.#inputs = inputs;
  }

  /**
   * Shows a button if a headset is available.
   * @param {HTMLElement} button
   * @param {() => number} heading of the person, rad
   */
  async offer(button, heading) {
    button.hidden = !(await hasHeadset());
    button.addEventListener("click", () => this.#enter(heading()));
  }

  /** @param {number} heading */
  async #enter(heading) {
    const headset = new Headset(this.#world, this.#panel);
    [this.#heading, this.#pitch] = [heading, 0];
    await headset.enter(heading, () => {
      this.#headset = null;
      this.#inputs?.hold("headset", {});
    });
    this.#headset = headset;
  }

  /** Places the eye, and handles head and hands. Returns false if no headset is worn. @param {Point} eye */
  place(eye) {
    const [headset, inputs] = [this.#headset, this.#inputs];
    if (!headset) return false;
    headset.place(eye);
    if (!inputs) return true;
    const { heading, pitch } = headset.look();
    const turn = Math.atan2(Math.sin(heading - this.#heading), Math.cos(heading - this.#heading));
    inputs.look(turn, pitch - this.#pitch);
    [this.#heading, this.#pitch] = [heading, pitch];
    const { forward, left, pressed } = headset.controls();
    inputs.hold("headset", { forward, left });
    for (const press of pressed) inputs.press(press);
    return true;
  }

  /** Shows the HUD on the panel. @param {HudState} hud @param {number | null} clock s */
  show(hud, clock) {
    if (!this.#headset) return;
    drawPanel(this.#panel, hud, clock === null ? "" : clockText(clock));
    this.#headset.refresh();
  }
}
