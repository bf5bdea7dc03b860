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

test("no default key has two actions", () => {
  const codes = ACTIONS.flatMap(({ keys }) => keys);
  expect(new Set(codes).size).toBe(codes.length);
});

describe("a changed key", () => {
  test("belongs to its new action alone, also on the next page", () => {
    new Bindings().bind(action("act"), "KeyW");
    const bindings = new Bindings();
    expect(bindings.action("KeyW")?.name).toBe("act");
    expect(bindings.action("KeyE")).toBeUndefined();
    expect(bindings.label("forward")).toBe("↑");
  });

  test("is forgotten by a reset", () => {
    const bindings = new Bindings();
    bindings.bind(action("act"), "KeyW");
    bindings.reset();
    expect(bindings.label("act")).toBe("E");
    expect(new Bindings().label("forward")).toBe("W or ↑");
  });

  test("may leave an action without one", () => {
    const bindings = new Bindings();
    bindings.bind(action("help"), "KeyP");
    expect(bindings.label("pause")).toBe("none");
  });
});

test.each(["{", "[]", '{"act":"KeyQ"}', '{"act":[1]}', "null"])("a damaged store is ignored: %s", (kept) => {
  localStorage.setItem("mjsim-keys", kept);
  expect(new Bindings().label("act")).toBe("E");
});

test("keys have names", () => {
  expect(["KeyQ", "Digit4", "ArrowLeft", "Space"].map(keyName)).toEqual(["Q", "4", "←", "Space"]);
});
