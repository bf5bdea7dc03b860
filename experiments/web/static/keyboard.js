// Keys that are held and pressed in the view.

export class Keyboard {
  #down = new Set();
  #bindings;
  #inputs;
  #commands;

  /**
   * @param {Bindings} bindings
   * @param {Inputs} inputs
   * @param {Object<string, () => void>} commands what the page itself does: pause, help
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

  /** Lets all keys go. */
  release() {
    this.#down.clear();
    this.#hold();
  }

  #pressed(action, code) {
    if (action.press) this.#inputs.press(action.press);
    else if (action.rows) this.#inputs.scroll(action.rows);
    else if (action.axes) {
      this.#down.add(code);
      this.#hold();
    } else this.#commands[action.name]();
  }

  #hold() {
    const sum = {};
    const actions = new Set([...this.#down].map((code) => this.#bindings.action(code)));
    for (const action of actions) {
      for (const [axis, value] of Object.entries(action?.axes ?? {})) sum[axis] = (sum[axis] ?? 0) + value;
    }
    this.#inputs.hold("keyboard", sum);
  }
}
