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

describe("a key is changed", () => {
  test("by the next key; the table says so, and the action that had it says that it has none", () => {
    change("act");
    expect(report()).toContain("Press the new key for: Pick up");
    key("KeyP");
    expect([keys("act"), keys("pause"), report()]).toEqual(["P", "none", "Pick up or place: P"]);
    expect(bindings.action("KeyP")?.name).toBe("act");
    expect(document.activeElement).toBe(dialog.querySelector("[data-action=act]")); // where a person without mouse was
  });

  test("not by Esc, which keeps the old one, nor by Tab, which leads on", () => {
    change("act");
    key("Tab");
    key("Escape");
    key("KeyQ");
    expect([keys("act"), report()]).toEqual(["E", ""]);
  });

  test("back by a reset", () => {
    change("forward");
    key("KeyZ");
    expect(keys("forward")).toBe("Z");
    /** @type {HTMLElement} */ (dialog.querySelector("#help-reset")).click();
    expect([keys("forward"), report()]).toEqual(["W or ↑", "All keys are reset."]);
  });
});

test("the table is closed by the key that opens it, and by its button", () => {
  key("KeyH");
  expect(help.open).toBe(false);
  help.show();
  /** @type {HTMLElement} */ (dialog.querySelector("#help-close")).click();
  expect(help.open).toBe(false);
  expect(closed).toHaveBeenCalledTimes(2);
});

test("keys are called as they are labelled on this keyboard, where the browser knows", async () => {
  Object.assign(navigator, { keyboard: { getLayoutMap: async () => new Map([["KeyW", "z"]]) } });
  await learnLayout();
  expect(bindings.label("forward")).toBe("Z or ↑");
  Object.assign(navigator, { keyboard: { getLayoutMap: async () => Promise.reject(new Error()) } });
  await learnLayout();
  expect(bindings.label("forward")).toBe("Z or ↑");
});
