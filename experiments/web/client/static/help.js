// The table of controls, and changing its keys.

/** @import { Action, Bindings } from "./bindings.js" */

import { ACTIONS, actionText, keyName } from "./bindings.js";
import { made, within } from "./dom.js";
import { textOf } from "./texts.js";

export class Help {
  #dialog;
  #bindings;
  /** @type {Action | null} */
  #changing = null;

  /**
   * @param {HTMLDialogElement} dialog
   * @param {Bindings} bindings
   * @param {() => void} closed is called when it was closed
   */
  constructor(dialog, bindings, closed) {
    this.#dialog = dialog;
    this.#bindings = bindings;
    dialog.addEventListener("close", closed);
    dialog.addEventListener("keydown", (event) => this.#key(event));
    this.#part("#help-close").addEventListener("click", () => dialog.close());
    this.#part("#help-reset").addEventListener("click", () => {
      bindings.reset();
      this.#fill();
      this.#report(textOf("keys_reset"));
    });
  }

  get open() {
    return this.#dialog.open;
  }

  show() {
    this.#changing = null;
    this.#fill();
    this.#report("");
    if (!this.#dialog.open) this.#dialog.showModal();
    this.#part("#help-close").focus({ preventScroll: true });
    this.#dialog.scrollTop = 0;
  }

  hide() {
    this.#dialog.close();
  }

  #fill() {
    this.#part("#keys").replaceChildren(...ACTIONS.map((action) => this.#row(action)));
  }

  /** @param {Action} action */
  #row(action) {
    const row = document.createElement("tr");
    const name = actionText(action);
    const what = made("th", name);
    what.scope = "row";
    const change = made("button", textOf("change"));
    change.type = "button";
    change.dataset.action = action.name;
    change.setAttribute("aria-label", textOf("change_key", { action: name }));
    change.addEventListener("click", () => {
      this.#changing = action;
      this.#report(textOf("press_key", { action: name }));
    });
    const cell = document.createElement("td");
    cell.append(change);
    const pad = made("td", action.axes ? textOf(action.pad) : action.pad);
    pad.className = "pads";
    row.append(what, made("td", this.#bindings.label(action.name)), pad, cell);
    return row;
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const action = this.#changing;
    if (!action) {
      if (this.#bindings.action(event.code)?.name !== "help") return;
      event.stopPropagation(); // otherwise the view handles the key and reopens the table
      return this.hide();
    }
    if (event.code === "Tab") return;
    event.preventDefault();
    this.#changing = null;
    if (event.code === "Escape") return this.#report("");
    this.#bindings.bind(action, event.code);
    this.#fill();
    this.#report(`${actionText(action)}: ${keyName(event.code)}`);
    this.#part(`[data-action="${action.name}"]`).focus();
  }

  /** @param {string} text */
  #report(text) {
    this.#part("#remap").textContent = text;
  }

  /** @param {string} selector */
  #part(selector) {
    return within(this.#dialog, selector, HTMLElement);
  }
}
