// @vitest-environment happy-dom
import { beforeEach, describe, expect, test, vi } from "vitest";

import { Settings } from "../static/settings.js";
import { Sounds } from "../static/sounds.js";

/** @import { HudState } from "../static/protocol.js" */

describe("settings", () => {
  /** @type {HTMLFormElement} */
  let form;
  beforeEach(() => {
    form = document.createElement("form");
    form.innerHTML = `<select name="sensitivity"><option value="1"></option><option value="2"></option></select>
      <select name="text"><option value="1"></option></select>
      <input name="inverted" type="checkbox"><input name="sounds" type="checkbox"><input name="calm" type="checkbox">`;
    localStorage.clear();
  });
  const input = (/** @type {string} */ name) => /** @type {HTMLInputElement} */ (form.querySelector(`[name=${name}]`));

  test("the callback receives the settings initially and after every change", () => {
    const told = vi.fn();
    new Settings(form, told);
    expect(told).toHaveBeenCalledTimes(1);
    input("sensitivity").value = "2";
    input("sensitivity").dispatchEvent(new Event("change"));
    expect(told.mock.lastCall?.[0]).toMatchObject({ sensitivity: 2, sounds: true });
  });

  test("settings are saved for the next page", () => {
    new Settings(form, () => {});
    input("inverted").checked = true;
    input("inverted").dispatchEvent(new Event("change"));
    input("inverted").checked = false;
    const later = new Settings(form, () => {});
    expect(later.values.inverted).toBe(true);
    expect(input("inverted").checked).toBe(true);
  });

  test("saved settings of the wrong type are ignored", () => {
    localStorage.setItem("mjsim-settings", JSON.stringify({ sensitivity: "fast", sounds: false }));
    expect(new Settings(form, () => {}).values).toMatchObject({ sensitivity: 1, sounds: false });
  });
});

describe("sounds", () => {
  /** @type {number[]} */
  let tones;
  /** @type {Sounds} */
  let sounds;
  beforeEach(() => {
    tones = [];
    const part = () => ({ connect: (/** @type {object} */ next) => next, start() {}, stop() {}, gain: value(), frequency: value((f) => tones.push(f)) });
    const value = (/** @type {(f: number) => void} */ set = () => {}) => ({ setValueAtTime: set, exponentialRampToValueAtTime() {} });
    vi.stubGlobal("AudioContext", class {
      state = "running";
      currentTime = 0;
      resume() {}
      createGain = part;
      createOscillator = part;
    });
    sounds = new Sounds();
    sounds.unlock();
    sounds.hear(state({}));
  });
  const state = (/** @type {object} */ more) =>
    /** @type {HudState} */ ({ delivered: 0, total: 2, inventory: [{ label: null }, { label: null }], message: null, ...more });

  test.each([
    [2, "a pick", { inventory: [{ label: "Mug" }, { label: null }] }],
    [2, "a place", { delivered: 1 }],
    [4, "the end", { delivered: 2 }],
    [2, "a refusal", { message: { text: "Nothing in reach", kind: "refusal" } }],
    [0, "anything else", { message: { text: "Walk", kind: "info" } }],
  ])("plays %i tones for %s", (count, _, more) => {
    sounds.hear(state(more));
    expect(tones).toHaveLength(count);
    sounds.hear(state(more));
    expect(tones).toHaveLength(count); // the sound is played only once
  });

  test("a footstep sounds at every stride", () => {
    for (let x = 0; x <= 2.2; x += 0.1) sounds.walk(x, 0);
    expect(tones).toHaveLength(3);
  });

  test("no sounds are played when sounds are switched off", () => {
    sounds.on = false;
    sounds.play("done");
    expect(tones).toHaveLength(0);
  });
});
