// The one table of controls: what, default keys, gamepad. Keys are kept in this browser.

/** @import { Input } from "./protocol.js" */

import { load, save } from "./store.js";

/**
 * @typedef {Partial<Record<"forward" | "left" | "turn" | "look", number>>} Axes from -1 to 1
 * @typedef {object} Action a row of the table of controls
 * @property {string} name
 * @property {string} text
 * @property {string[]} keys default keys
 * @property {string} pad where it is on a gamepad
 * @property {Axes} [axes] held while the key is down
 * @property {number} [button] of a gamepad
 * @property {NonNullable<Input["press"]>} [press]
 * @property {number} [rows] by which the list is scrolled
 */


const NAME = "mjsim-keys";

/** @type {Action[]} */
export const ACTIONS = [
  { name: "forward", text: "Walk forward", keys: ["KeyW", "ArrowUp"], pad: "left stick", axes: { forward: 1 } },
  { name: "back", text: "Walk back", keys: ["KeyS", "ArrowDown"], pad: "left stick", axes: { forward: -1 } },
  { name: "left", text: "Step left", keys: ["KeyA"], pad: "left stick", axes: { left: 1 } },
  { name: "right", text: "Step right", keys: ["KeyD"], pad: "left stick", axes: { left: -1 } },
  { name: "turnLeft", text: "Turn left", keys: ["ArrowLeft"], pad: "right stick", axes: { turn: 1 } },
  { name: "turnRight", text: "Turn right", keys: ["ArrowRight"], pad: "right stick", axes: { turn: -1 } },
  { name: "lookUp", text: "Look up", keys: ["KeyR"], pad: "right stick", axes: { look: 1 } },
  { name: "lookDown", text: "Look down", keys: ["KeyF"], pad: "right stick", axes: { look: -1 } },
  { name: "act", text: "Pick up or put into the bin", keys: ["KeyE"], pad: "A", button: 0, press: "act" },
  { name: "leftHand", text: "Left hand: pick up, or put into the bin", keys: ["Digit1"], pad: "X", button: 2, press: "left hand" },
  { name: "rightHand", text: "Right hand: pick up, or put into the bin", keys: ["Digit2"], pad: "B", button: 1, press: "right hand" },
  { name: "listUp", text: "List up", keys: ["PageUp"], pad: "LB", button: 4, rows: -1 },
  { name: "listDown", text: "List down", keys: ["PageDown"], pad: "RB", button: 5, rows: 1 },
  { name: "pause", text: "Pause", keys: ["KeyP"], pad: "start", button: 9 },
  { name: "help", text: "This table", keys: ["KeyH"], pad: "back", button: 8 },
];

/** @type {Record<string, string>} */
const KEY_NAMES = { ArrowUp: "↑", ArrowDown: "↓", ArrowLeft: "←", ArrowRight: "→", PageUp: "Page up", PageDown: "Page down" };

export class Bindings {
  /** @type {Map<string, string[]>} */
  #keys = new Map(); // name of an action -> codes of its keys

  constructor() {
    const kept = load(NAME);
    for (const action of ACTIONS) {
      const codes = kept?.[action.name];
      const usable = Array.isArray(codes) && codes.every((/** @type {unknown} */ code) => typeof code === "string");
      this.#keys.set(action.name, usable ? codes : action.keys);
    }
  }

  /**
   * The action of a key.
   * @param {string} code
   */
  action(code) {
    return ACTIONS.find((action) => this.#keys.get(action.name)?.includes(code));
  }

  /**
   * Names of an action's keys.
   * @param {string} name of the action
   */
  label(name) {
    return this.#keys.get(name)?.map(keyName).join(" or ") || "none";
  }

  /**
   * Gives an action one key; another action loses it.
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
let layout = new Map(); // code of a key -> what it types on this keyboard

/** Learns what the keys of this keyboard are called, where the browser tells it. */
export async function learnLayout() {
  const { keyboard } = /** @type {{ keyboard?: { getLayoutMap(): Promise<ReadonlyMap<string, string>> } }} */ (navigator);
  layout = (await keyboard?.getLayoutMap().catch(() => undefined)) ?? layout;
}

/** @param {string} code */
export const keyName = (code) =>
  KEY_NAMES[code] ?? layout.get(code)?.toUpperCase() ?? code.replace(/^(Key|Digit)/, "");
