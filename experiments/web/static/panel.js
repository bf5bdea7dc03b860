// The dialog in the middle of the page: a title, sentences, and buttons.

export class Panel {
  #dialog;
  #closed;

  /**
   * @param {HTMLDialogElement} dialog
   * @param {() => void} closed is called when it was closed
   */
  constructor(dialog, closed) {
    this.#dialog = dialog;
    this.#closed = closed;
    dialog.addEventListener("cancel", (event) => event.preventDefault());
  }

  get open() {
    return this.#dialog.open;
  }

  /**
   * @param {string} title
   * @param {string[]} texts
   * @param {[string, () => void][]} actions labels of buttons and what they do
   */
  show(title, texts, actions = []) {
    this.#dialog.querySelector("h2").textContent = title;
    this.#dialog.querySelector("#panel-text").replaceChildren(...texts.map((text) => made("p", text)));
    const buttons = actions.map(([label, act], i) => {
      const button = made("button", label);
      button.type = "button";
      button.className = i === 0 ? "button" : "";
      button.addEventListener("click", act);
      return button;
    });
    this.#dialog.querySelector("#panel-actions").replaceChildren(...buttons);
    if (!this.#dialog.open) this.#dialog.showModal();
    (buttons[0] ?? this.#dialog).focus();
  }

  hide() {
    if (!this.#dialog.open) return;
    this.#dialog.close();
    this.#closed();
  }
}

export function made(tag, text) {
  const element = document.createElement(tag);
  element.textContent = text;
  return element;
}
