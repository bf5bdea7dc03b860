// @vitest-environment happy-dom
import { beforeEach, describe, expect, test, vi } from "vitest";

import { Bindings, learnLayout } from "../static/bindings.js";
import { Help } from "../static/help.js";
import { showPage } from "./page.js";

const closed = vi.fn();
/** @type {HTMLDialogElement} */
let dialog;
/** @type {Bindings} */
let bindings;
/** @type {Help} */
let help;
/** @param {string} code */
const key = (code) => document.activeElement?.dispatchEvent(new KeyboardEvent("keydown", { code, bubbles: true, cancelable: true }));
/** @param {string} action */
const change = (action) => /** @type {HTMLElement} */ (dialog.querySelector(`[data-action=${action}]`)).click();
/** @param {string} action */
const keys = (action) => dialog.querySelector(`[data-action=${action}]`)?.closest("tr")?.children[1]?.textContent;
const report = () => dialog.querySelector("#remap")?.textContent;

beforeEach(() => {
  vi.clearAllMocks();
  localStorage.clear();
  showPage("play");
  dialog = /** @type {HTMLDialogElement} */ (document.getElementById("help"));
  bindings = new Bindings();
  help = new Help(dialog, bindings, closed);
  help.show();
});

describe("changing a key in the table", () => {
  test("the next key is bound to the chosen action and taken from its previous action", () => {
    change("act");
    expect(report()).toContain("Press the new key for: Pick up");
    key("KeyP");
    expect([keys("act"), keys("pause"), report()]).toEqual(["P", "none", "Pick up or place: P"]);
    expect(bindings.action("KeyP")?.name).toBe("act");
    expect(document.activeElement).toBe(dialog.querySelector("[data-action=act]")); // the focus returns for keyboard users
  });

  test("Esc cancels the change, and Tab is not accepted as a new key", () => {
    change("act");
    key("Tab");
    key("Escape");
    key("KeyQ");
    expect([keys("act"), report()]).toEqual(["E", ""]);
  });

  test("the reset button restores the default keys", () => {
    change("forward");
    key("KeyZ");
    expect(keys("forward")).toBe("Z");
    /** @type {HTMLElement} */ (dialog.querySelector("#help-reset")).click();
    expect([keys("forward"), report()]).toEqual(["W or ↑", "All keys are reset."]);
  });
});

test("the table closes with the key that opens it and with its button", () => {
  key("KeyH");
  expect(help.open).toBe(false);
  help.show();
  /** @type {HTMLElement} */ (dialog.querySelector("#help-close")).click();
  expect(help.open).toBe(false);
  expect(closed).toHaveBeenCalledTimes(2);
});

test("keys have the labels of the person's keyboard layout if the browser provides it", async () => {
  Object.assign(navigator, { keyboard: { getLayoutMap: async () => new Map([["KeyW", "z"]]) } });
  await learnLayout();
  expect(bindings.label("forward")).toBe("Z or ↑");
  Object.assign(navigator, { keyboard: { getLayoutMap: async () => Promise.reject(new Error()) } });
  await learnLayout();
  expect(bindings.label("forward")).toBe("Z or ↑");
});
