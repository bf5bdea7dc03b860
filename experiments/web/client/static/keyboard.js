// Held and pressed keys of the view.

/** @import { Bindings } from "./bindings.js" */
/** @import { Inputs } from "./inputs.js" */

/**
 * @param {Bindings} bindings
 * @param {Inputs} inputs
 * @param {Record<string, () => void>} commands of the page itself: pause, help
 * @param {() => boolean} listens returns true if keys are for the view
 */
export function connectKeyboard(bindings, inputs, commands, listens) {
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || !listens()) return;
    const action = bindings.action(event.code);
    if (!action) return;
    event.preventDefault();
    if (event.repeat && !action.rows && !action.axes) return; // a key held since before a pause walks on
    if (action.press) inputs.press(action.press);
    else if (action.rows) inputs.scroll(action.rows);
    else if (action.axes) inputs.hold(event.code, action.axes);
    else commands[action.name]?.();
  });
  window.addEventListener("keyup", (event) => inputs.hold(event.code, {}));
}
