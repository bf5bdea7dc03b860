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

describe("held inputs", () => {
  test("held inputs are sent only when they change", () => {
    inputs.hold("keyboard", { forward: 1 });
    inputs.hold("keyboard", { forward: 1 });
    inputs.hold("keyboard", {});
    expect(sent).toEqual([{ forward: 1 }, {}]);
  });

  test("held inputs of all devices are added and limited to 1", () => {
    inputs.hold("keyboard", { forward: 1, left: 1 });
    inputs.hold("gamepad", { forward: 0.5, left: -1, turn: -0.25 });
    expect(sent.at(-1)).toEqual({ forward: 1, turn: -0.25 });
  });

  test("releasing clears the held inputs of all devices", () => {
    inputs.release();
    inputs.hold("keyboard", { forward: 1 });
    inputs.release();
    expect(sent).toEqual([{ forward: 1 }, {}]);
  });

  test("held inputs can be sent again to synchronize a session", () => {
    inputs.hold("touch", { look: -1 });
    inputs.send();
    expect(sent).toEqual([{ look: -1 }, { look: -1 }]);
  });
});

test("mouse and wheel movements are combined before they are sent", () => {
  inputs.look(0.1, -0.2);
  inputs.look(0.1, 0);
  inputs.scroll(3);
  expect(sent).toEqual([]);
  vi.runAllTimers();
  expect(sent).toEqual([{ yaw: 0.2, pitch: -0.2, scroll: 3 }]);
});

test("a press is sent immediately together with all pending movements", () => {
  inputs.look(100, 0);
  inputs.scroll(-1000);
  inputs.press("left hand");
  vi.runAllTimers();
  expect(sent).toEqual([{ press: "left hand", yaw: 7, scroll: -100 }]);
});
