// The table of controls with default keys and gamepad buttons. Changed keys are stored in this browser.

/** @import { Input } from "./protocol.js" */

import { load, save } from "./store.js";
import { textOf } from "./texts.js";

/**
 * @typedef {Partial<Record<"forward" | "left" | "turn" | "look", number>>} Axes from -1 to 1
 * @typedef {object} Action a row of the table of controls
 * @property {string} name
 * @property {string[]} keys default keys
 * @property {string} pad button of a gamepad, or name of the text for a stick
 * @property {Axes} [axes] held while the key is down
 * @property {number} [button] of a gamepad
 * @property {NonNullable<Input["press"]>} [press]
 * @property {number} [rows] by which the list is scrolled
 */


const NAME = "mjsim-keys";

/** @type {Action[]} */
export const ACTIONS = [
  { name: "forward", keys: ["KeyW", "ArrowUp"], pad: "left_stick", axes: { forward: 1 } },
  { name: "back", keys: ["KeyS", "ArrowDown"], pad: "left_stick", axes: { forward: -1 } },
  { name: "left", keys: ["KeyA"], pad: "left_stick", axes: { left: 1 } },
  { name: "right", keys: ["KeyD"], pad: "left_stick", axes: { left: -1 } },
  { name: "turnLeft", keys: ["ArrowLeft"], pad: "right_stick", axes: { turn: 1 } },
  { name: "turnRight", keys: ["ArrowRight"], pad: "right_stick", axes: { turn: -1 } },
  { name: "lookUp", keys: ["KeyR"], pad: "right_stick", axes: { look: 1 } },
  { name: "lookDown", keys: ["KeyF"], pad: "right_stick", axes: { look: -1 } },
  { name: "act", keys: ["KeyE"], pad: "A", button: 0, press: "act" },
  { name: "leftHand", keys: ["Digit1"], pad: "X", button: 2, press: "left hand" },
  { name: "rightHand", keys: ["Digit2"], pad: "B", button: 1, press: "right hand" },
  { name: "listUp", keys: ["PageUp"], pad: "LB", button: 4, rows: -1 },
  { name: "listDown", keys: ["PageDown"], pad: "RB", button: 5, rows: 1 },
  { name: "pause", keys: ["KeyP"], pad: "start", button: 9 },
  { name: "help", keys: ["KeyH"], pad: "back", button: 8 },
];

/** @type {Record<string, string>} */
const ARROWS = { ArrowUp: "↑", ArrowDown: "↓", ArrowLeft: "←", ArrowRight: "→" };
/** @type {Record<string, string>} */
const NAMED = { PageUp: "page_up", PageDown: "page_down" };

export class Bindings {
  /** @type {Map<string, string[]>} */
  #keys = new Map(); // action names -> key codes

  constructor() {
    const kept = load(NAME);
    for (const action of ACTIONS) {
      const codes = kept?.[action.name];
      const usable = Array.isArray(codes) && codes.every((/** @type {unknown} */ code) => typeof code === "string");
      this.#keys.set(action.name, usable ? codes : action.keys);
    }
  }

  /**
   * Returns the action of a key.
   * @param {string} code
   */
  action(code) {
    return ACTIONS.find((action) => this.#keys.get(action.name)?.includes(code));
  }

  /**
   * Returns the names of an action's keys.
   * @param {string} name of the action
   */
  label(name) {
    return this.#keys.get(name)?.map(keyName).join(` ${textOf("or")} `) || textOf("no_key");
  }

  /** Returns the name of an action's first key. @param {string} name of the action */
  key(name) {
    return this.#keys.get(name)?.map(keyName)[0] ?? textOf("no_key");
  }

  /**
   * Assigns a key to an action. Any other action loses it.
   * @param {Action} action
   * @param {string} code
   */
  bind(action, code) {
    for (const [name, codes] of this.#keys) this.#keys.set(name, codes.filter((other) => other !== code));
    this.#keys.set(action.name, [code]);
    save(NAME, Object.fromEntries(this.#keys));
  }

  reset() {
    for (const action of ACTIONS) this.#keys.set(action.name, action.keys);
    save(NAME, null);
  }
}

/** @type {ReadonlyMap<string, string>} */
let layout = new Map(); // key codes -> characters of this keyboard layout

/** Loads the keyboard layout if the browser supports it. */
export async function learnLayout() {
  const { keyboard } = /** @type {{ keyboard?: { getLayoutMap(): Promise<ReadonlyMap<string, string>> } }} */ (navigator);
  layout = (await keyboard?.getLayoutMap().catch(() => undefined)) ?? layout;
}

/** @param {string} code */
export function keyName(code) {
  if (NAMED[code]) return textOf(NAMED[code]);
  return ARROWS[code] ?? layout.get(code)?.toUpperCase() ?? code.replace(/^(Key|Digit)/, "");
}

/** Returns the label of an action. @param {Action} action */
export const actionText = (action) => textOf(`action_${action.name}`);
