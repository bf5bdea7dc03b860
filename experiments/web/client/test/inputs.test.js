import { beforeEach, describe, expect, test, vi } from "vitest";

import { Inputs } from "../static/inputs.js";

/** @type {object[]} */
let sent = [];
/** @type {Inputs} */
let inputs;

beforeEach(() => {
  vi.useFakeTimers();
  sent = [];
  inputs = new Inputs((input) => sent.push(input));
});

describe("what is held", () => {
  test("is sent when it changes", () => {
    inputs.hold("keyboard", { forward: 1 });
    inputs.hold("keyboard", { forward: 1 });
    inputs.hold("keyboard", {});
    expect(sent).toEqual([{ forward: 1 }, {}]);
  });

  test("is the sum of all sources, at most 1", () => {
    inputs.hold("keyboard", { forward: 1, left: 1 });
    inputs.hold("gamepad", { forward: 0.5, left: -1, turn: -0.25 });
    expect(sent.at(-1)).toEqual({ forward: 1, turn: -0.25 });
  });

  test("is released by all sources at once", () => {
    inputs.release();
    inputs.hold("keyboard", { forward: 1 });
    inputs.release();
    expect(sent).toEqual([{ forward: 1 }, {}]);
  });

  test("is repeated for a session that may have another state", () => {
    inputs.hold("touch", { look: -1 });
    inputs.send();
    expect(sent).toEqual([{ look: -1 }, { look: -1 }]);
  });
});

test("mouse and wheel are collected for a while", () => {
  inputs.look(0.1, -0.2);
  inputs.look(0.1, 0);
  inputs.scroll(3);
  expect(sent).toEqual([]);
  vi.runAllTimers();
  expect(sent).toEqual([{ yaw: 0.2, pitch: -0.2, scroll: 3 }]);
});

test("a press is sent at once, with all that was collected", () => {
  inputs.look(100, 0);
  inputs.scroll(-1000);
  inputs.press("left hand");
  vi.runAllTimers();
  expect(sent).toEqual([{ press: "left hand", yaw: 7, scroll: -100 }]);
});
