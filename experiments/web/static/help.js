// The table of controls, and changing its keys.

import { ACTIONS, keyName } from "./bindings.js";
import { made } from "./panel.js";

export class Help {
  #dialog;
  #bindings;
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
    dialog.querySelector("#help-close").addEventListener("click", () => dialog.close());
    dialog.querySelector("#help-reset").addEventListener("click", () => {
      bindings.reset();
      this.#fill();
      this.#say("All keys are as at first.");
    });
  }

  get open() {
    return this.#dialog.open;
  }

  show() {
    this.#changing = null;
    this.#fill();
    this.#say("");
    if (!this.#dialog.open) this.#dialog.showModal();
    this.#dialog.querySelector("#help-close").focus({ preventScroll: true });
    this.#dialog.scrollTop = 0;
  }

  hide() {
    this.#dialog.close();
  }

  #fill() {
    this.#dialog.querySelector("#keys").replaceChildren(...ACTIONS.map((action) => this.#row(action)));
  }

  #row(action) {
    const row = document.createElement("tr");
    const what = made("th", action.text);
    what.scope = "row";
    const change = made("button", "Change");
    change.type = "button";
    change.dataset.action = action.name;
    change.setAttribute("aria-label", `Change the key of: ${action.text}`);
    change.addEventListener("click", () => {
      this.#changing = action;
      this.#say(`Press the new key for: ${action.text}. Esc keeps the old one.`);
    });
    const cell = document.createElement("td");
    cell.append(change);
    const pad = made("td", action.pad);
    pad.className = "pads";
    row.append(what, made("td", this.#bindings.label(action)), pad, cell);
    return row;
  }

  #key(event) {
    const action = this.#changing;
    if (!action) {
      if (this.#bindings.action(event.code)?.name !== "help") return;
      event.stopPropagation(); // else the view, which listens again, opens the table anew
      this.hide();
      return;
    }
    if (event.code === "Tab") return;
    event.preventDefault();
    this.#changing = null;
    if (event.code === "Escape") {
      this.#say("");
      return;
    }
    this.#bindings.bind(action, event.code);
    this.#fill();
    this.#say(`${action.text}: ${keyName(event.code)}`);
    this.#dialog.querySelector(`[data-action="${action.name}"]`).focus();
  }

  #say(text) {
    this.#dialog.querySelector("#remap").textContent = text;
  }
}
