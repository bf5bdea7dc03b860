// The one table of controls: what, default keys, gamepad. Keys are kept in this browser.

import { load, remove, save } from "./store.js";

const NAME = "mjsim-keys";

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

const KEY_NAMES = { ArrowUp: "↑", ArrowDown: "↓", ArrowLeft: "←", ArrowRight: "→", PageUp: "Page up", PageDown: "Page down" };

export class Bindings {
  #keys = new Map(); // name of an action -> codes of its keys

  constructor() {
    const kept = load(NAME);
    for (const action of ACTIONS) {
      const codes = kept?.[action.name];
      const usable = Array.isArray(codes) && codes.every((code) => typeof code === "string");
      this.#keys.set(action.name, usable ? codes : action.keys);
    }
  }

  /** The action of a key, or undefined. */
  action(code) {
    return ACTIONS.find((action) => this.#keys.get(action.name).includes(code));
  }

  /** Names of an action's keys. */
  label(action) {
    return this.#keys.get(action.name).map(keyName).join(" or ") || "none";
  }

  /** Gives an action one key; another action loses it. */
  bind(action, code) {
    for (const [name, codes] of this.#keys) this.#keys.set(name, codes.filter((other) => other !== code));
    this.#keys.set(action.name, [code]);
    save(NAME, Object.fromEntries(this.#keys));
  }

  reset() {
    for (const action of ACTIONS) this.#keys.set(action.name, action.keys);
    remove(NAME);
  }
}

export const keyName = (code) => KEY_NAMES[code] ?? code.replace(/^(Key|Digit)/, "");
