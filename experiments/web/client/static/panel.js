// The dialog in the middle of the page: a title, sentences, pictures, keys, and buttons.

/** @import { Dialog } from "./dialogs.js" */

import { made, within } from "./dom.js";
import { textOf } from "./texts.js";

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

  /** @param {Dialog} dialog */
  show(dialog) {
    const { title, texts, pictures = [], markers, keys = [], buttons = [] } = dialog;
    const described = JSON.stringify(dialog);
    if (described === this.#shown && this.#dialog.open) return; // a button keeps its focus
    this.#shown = described;
    within(this.#dialog, "h2", HTMLElement).textContent = title;
    const content = [...texts.map((text) => made("p", text)), ...example(pictures), ...explained(markers), ...keyCaps(keys)];
    within(this.#dialog, "#panel-text", HTMLElement).replaceChildren(...content);
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

/** Shows what belongs where. @param {[string, string][]} pictures addresses and labels */
function example(pictures) {
  if (!pictures.length) return [];
  const row = made("p", textOf("example"));
  row.className = "example";
  const figures = pictures.map(([address, label]) => {
    const figure = made("span", label);
    figure.prepend(Object.assign(new Image(), { src: address, alt: "" })); // the label has the name
    return figure;
  });
  row.append(...figures.flatMap((figure, i) => (i ? [" → ", figure] : [" ", figure])));
  return [row];
}

/** Shows the markers with a line for each kind. @param {Dialog["markers"]} markers */
function explained(markers) {
  if (!markers) return [];
  const [figure, legend] = [made("figure", ""), made("figcaption", "")];
  figure.className = "explained";
  legend.append(...markers.legend.map((line) => made("p", line)));
  figure.append(Object.assign(new Image(), { src: markers.address, alt: textOf("markers_picture"), width: 640, height: 400 }), legend);
  return [figure];
}

/** Draws key caps with their effect. @param {[string[], string][]} keys */
function keyCaps(keys) {
  if (!keys.length) return [];
  const list = made("dl", "");
  list.className = "keys";
  for (const [names, effect] of keys) {
    const [group, caps] = [made("div", ""), made("dt", "")];
    caps.append(...names.flatMap((name) => [made("kbd", name), " "]));
    group.append(caps, made("dd", effect));
    list.append(group);
  }
  return [list];
}
