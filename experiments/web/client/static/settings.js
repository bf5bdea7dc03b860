// Settings of picture, mouse and sound, stored in this browser and independent of the condition.

import { load, save } from "./store.js";

const NAME = "mjsim-settings";

/** @typedef {{ sensitivity: number, inverted: boolean, sounds: boolean, calm: boolean, text: number, degrees: number }} Values sensitivity of the mouse and size of text as factors; degrees: field of view, 0 where none was chosen; calm: turns in steps, dark edges while moving */

export class Settings {
  /** @type {Values} */
  values;
  #changed;

  /** @param {HTMLFormElement} form @param {(values: Values) => void} changed is called now and with every change */
  constructor(form, changed) {
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.values = { sensitivity: 1, inverted: false, sounds: true, calm, text: 1, degrees: 0 };
    this.#changed = changed;
    const kept = load(NAME) ?? {};
    for (const [name, value] of Object.entries(this.values)) {
      if (typeof kept[name] === typeof value) Object.assign(this.values, { [name]: kept[name] });
    }
    for (const input of form.querySelectorAll("input, select")) this.#connect(/** @type {HTMLInputElement} */ (input));
    changed(this.values);
  }

  /** @param {HTMLInputElement} input whose name is that of a value */
  #connect(input) {
    const name = /** @type {keyof Values} */ (input.name);
    if (input.type === "checkbox") input.checked = this.values[name] === true;
    else input.value = `${this.values[name]}`;
    input.addEventListener("change", () => {
      Object.assign(this.values, { [name]: input.type === "checkbox" ? input.checked : Number(input.value) });
      save(NAME, this.values);
      this.#changed(this.values);
    });
  }
}
