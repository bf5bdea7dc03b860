// The dialog in the middle of the page: a title, sentences, and buttons.

/** @import { Dialog } from "./dialogs.js" */

import { made, within } from "./dom.js";

export class Panel {
  #dialog;
  #actions;
  #closed;
  #shown = ""; // the dialog that is shown, as JSON

  /**
   * @param {HTMLDialogElement} dialog
   * @param {Record<string, () => void>} actions of buttons
   * @param {() => void} closed is called when it was closed
   */
  constructor(dialog, actions, closed) {
    this.#dialog = dialog;
    this.#actions = actions;
    this.#closed = closed;
    dialog.addEventListener("cancel", (event) => event.preventDefault());
  }

  get open() {
    return this.#dialog.open;
  }

  get title() {
    return within(this.#dialog, "h2", HTMLElement).textContent;
  }

  /** @param {Dialog} dialog */
  show(dialog) {
    const { title, texts, buttons = [] } = dialog;
    const content = JSON.stringify(dialog);
    if (content === this.#shown && this.open) return; // a button keeps its focus
    this.#shown = content;
    within(this.#dialog, "h2", HTMLElement).textContent = title;
    within(this.#dialog, "#panel-text", HTMLElement).replaceChildren(...texts.map((text) => made("p", text)));
    const elements = buttons.map(([label, action], i) => {
      const button = made("button", label);
      button.type = "button";
      button.className = i === 0 ? "button" : "";
      button.addEventListener("click", () => this.#actions[action]?.());
      return button;
    });
    within(this.#dialog, "#panel-actions", HTMLElement).replaceChildren(...elements);
    if (!this.#dialog.open) this.#dialog.showModal();
    (elements[0] ?? this.#dialog).focus();
  }

  hide() {
    if (!this.#dialog.open) return;
    this.#dialog.close();
    this.#closed();
  }
}
