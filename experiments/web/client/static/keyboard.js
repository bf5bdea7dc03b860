// Keys that are held and pressed in the view.

/** @import { Action, Bindings } from "./bindings.js" */
/** @import { Inputs } from "./inputs.js" */

import { summed } from "./bindings.js";

export class Keyboard {
  /** @type {Set<string>} */
  #down = new Set();
  #bindings;
  #inputs;
  #commands;

  /**
   * @param {Bindings} bindings
   * @param {Inputs} inputs
   * @param {Record<string, () => void>} commands of the page itself: pause, help
   * @param {() => boolean} listens whether keys are for the view
   */
  constructor(bindings, inputs, commands, listens) {
    this.#bindings = bindings;
    this.#inputs = inputs;
    this.#commands = commands;
    window.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey || !listens()) return;
      const action = bindings.action(event.code);
      if (!action) return;
      event.preventDefault();
      if (!event.repeat || action.rows) this.#pressed(action, event.code);
    });
    window.addEventListener("keyup", (event) => {
      if (this.#down.delete(event.code)) this.#hold();
    });
  }

  /** Releases all keys. */
  release() {
    this.#down.clear();
    this.#hold();
  }

  /** @param {Action} action @param {string} code */
  #pressed(action, code) {
    if (action.press) this.#inputs.press(action.press);
    else if (action.rows) this.#inputs.scroll(action.rows);
    else if (action.axes) {
      this.#down.add(code);
      this.#hold();
    } else this.#commands[action.name]?.();
  }

  #hold() {
    const actions = new Set([...this.#down].map((code) => this.#bindings.action(code)));
    this.#inputs.hold("keyboard", summed([...actions].map((action) => action?.axes ?? {})));
  }
}
