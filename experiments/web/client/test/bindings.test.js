// @vitest-environment happy-dom
import { beforeEach, describe, expect, test } from "vitest";

import { ACTIONS, Bindings, keyName } from "../static/bindings.js";
import { giveTexts } from "./page.js";

beforeEach(() => {
  localStorage.clear();
  giveTexts();
});

/** @param {string} name */
function action(name) {
  const found = ACTIONS.find((one) => one.name === name);
  if (!found) throw new Error(name);
  return found;
}

test("no key is bound to two actions by default", () => {
  const codes = ACTIONS.flatMap(({ keys }) => keys);
  expect(new Set(codes).size).toBe(codes.length);
});

describe("changing a key", () => {
  test("a changed key triggers only its new action, and the change is saved", () => {
    new Bindings().bind(action("act"), "KeyW");
    const bindings = new Bindings();
    expect(bindings.action("KeyW")?.name).toBe("act");
    expect(bindings.action("KeyE")).toBeUndefined();
    expect(bindings.label("forward")).toBe("↑");
  });

  test("a reset restores the default keys", () => {
    const bindings = new Bindings();
    bindings.bind(action("act"), "KeyW");
    bindings.reset();
    expect(bindings.label("act")).toBe("E");
    expect(new Bindings().label("forward")).toBe("W or ↑");
  });

  test("an action has no key if its only key is bound to another action", () => {
    const bindings = new Bindings();
    bindings.bind(action("help"), "KeyP");
    expect(bindings.label("pause")).toBe("none");
  });
});

test.each(["{", "[]", '{"act":"KeyQ"}', '{"act":[1]}', "null"])("invalid saved bindings are ignored: %s", (kept) => {
  localStorage.setItem("mjsim-keys", kept);
  expect(new Bindings().label("act")).toBe("E");
});

test("keys have readable names", () => {
  expect(["KeyQ", "Digit4", "ArrowLeft", "Space"].map(keyName)).toEqual(["Q", "4", "←", "Space"]);
});
