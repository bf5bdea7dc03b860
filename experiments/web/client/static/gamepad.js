// A gamepad of the standard layout: left stick walks, right stick turns and looks, buttons as in the table. Browsers
// do not report which button is which on other gamepads, so a press on them is answered with a sentence.

/** @import { Inputs } from "./inputs.js" */

import { ACTIONS } from "./bindings.js";

const DEAD = 0.15; // dead zone around a stick's centre, as a share of its range

/**
 * @param {Inputs} inputs
 * @param {Record<string, () => void>} commands of the page itself
 * @param {() => boolean} listens returns true if inputs are for the view
 */
export function connectGamepad(inputs, commands, listens) {
  /** @type {boolean[]} */
  let before = [];
  let running = false;

  const stick = (/** @type {number} */ value) => {
    const beyond = Math.max(0, Math.abs(value) - DEAD) / (1 - DEAD);
    return Math.round(Math.sign(value) * Math.min(1, beyond) * 20) / 20; // coarse steps, so that few inputs are sent
  };
  const poll = () => {
    const pads = navigator.getGamepads().filter((found) => found !== null);
    const pad = pads.find((found) => found.mapping === "standard") ?? pads[0];
    if (!pad) {
      running = false;
      return inputs.hold("gamepad", {});
    }
    const pressed = pad.buttons.map((button) => button.pressed);
    if (pad.mapping !== "standard") {
      if (pressed.some((down, i) => down && !before[i])) commands.unknownPad?.();
      before = pressed;
      return requestAnimationFrame(poll);
    }
    if (listens()) {
      const [x = 0, y = 0, turn = 0, look = 0] = pad.axes.map(stick);
      inputs.hold("gamepad", { forward: -y, left: -x, turn: -turn, look: -look });
    }
    for (const action of ACTIONS) {
      if (action.button === undefined || !pressed[action.button] || before[action.button]) continue;
      if (!action.press && !action.rows) commands[action.name]?.();
      else if (!listens() && action.name === "act") commands.confirm?.();
      else if (listens() && action.press) inputs.press(action.press);
      else if (listens() && action.rows) inputs.scroll(action.rows);
    }
    before = pressed;
    requestAnimationFrame(poll);
  };
  window.addEventListener("gamepadconnected", () => {
    if (!running) requestAnimationFrame(poll);
    running = true;
  });
}
