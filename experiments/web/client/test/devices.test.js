// @vitest-environment happy-dom
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";

import { Bindings } from "../static/bindings.js";
import { connectGamepad } from "../static/gamepad.js";
import { Inputs } from "../static/inputs.js";
import { connectKeyboard } from "../static/keyboard.js";
import { connectMouse, connectTouch } from "../static/pointer.js";
import { showPage, watchListeners } from "./page.js";

/** @type {object[]} */
let sent = [];
let listening = true;
/** @type {Inputs} */
let inputs;
/** @type {HTMLCanvasElement} */
let canvas;
const [pause, confirm, unknownPad] = [vi.fn(), vi.fn(), vi.fn()];
const listens = () => listening;

/** Sends an event with values that its constructor does not take. @param {EventTarget} target @param {Event} event @param {object} [values] */
function send(target, event, values = {}) {
  for (const [name, value] of Object.entries(values)) Object.defineProperty(event, name, { value });
  target.dispatchEvent(event);
  return event;
}

beforeEach(watchListeners);
beforeEach(() => {
  vi.useFakeTimers();
  vi.clearAllMocks();
  localStorage.clear();
  showPage("play");
  [sent, listening] = [[], true];
  inputs = new Inputs((input) => sent.push(input));
  canvas = /** @type {HTMLCanvasElement} */ (document.getElementById("screen"));
});

describe("the keyboard", () => {
  beforeEach(() => connectKeyboard(new Bindings(), inputs, { pause }, listens));
  const key = (/** @type {string} */ code, type = "keydown", more = {}) =>
    send(window, new KeyboardEvent(type, { code, cancelable: true, ...more }));

  test("walks while keys are down; two keys of one direction are not faster", () => {
    key("KeyW");
    key("ArrowUp");
    key("KeyW", "keydown", { repeat: true });
    key("KeyA");
    key("KeyW", "keyup");
    key("ArrowUp", "keyup");
    key("KeyA", "keyup");
    expect(sent).toEqual([{ forward: 1 }, { forward: 1, left: 1 }, { left: 1 }, {}]);
  });

  test("presses once however long a key is down, but scrolls on", () => {
    for (const repeat of [false, true]) {
      key("KeyE", "keydown", { repeat });
      key("PageDown", "keydown", { repeat });
    }
    key("KeyP");
    vi.runAllTimers();
    expect(sent).toEqual([{ press: "act" }, { scroll: 2 }]);
    expect(pause).toHaveBeenCalledOnce();
  });

  test("leaves to the browser what is its own", () => {
    expect(key("KeyW", "keydown", { ctrlKey: true }).defaultPrevented).toBe(false);
    expect(key("F5").defaultPrevented).toBe(false);
    listening = false; // a dialog is open
    expect(key("KeyW").defaultPrevented).toBe(false);
    expect(sent).toEqual([]);
  });
});

describe("the mouse", () => {
  /** @type {ReturnType<typeof connectMouse>} */
  let mouse;
  beforeEach(() => {
    mouse = connectMouse(canvas, inputs, listens);
    canvas.requestPointerLock = async () => {
      Object.defineProperty(document, "pointerLockElement", { value: canvas, configurable: true });
    };
  });
  afterEach(() => Reflect.deleteProperty(document, "pointerLockElement"));
  const move = (/** @type {number} */ movementX, /** @type {number} */ movementY) => {
    send(document, new MouseEvent("mousemove"), { movementX, movementY });
    vi.runAllTimers();
  };

  test("looks around once it is captured, as fast and as upright as the person wants", () => {
    move(100, 0);
    expect(sent).toEqual([]);
    canvas.click();
    move(100, 40);
    Object.assign(mouse, { sensitivity: 2, inverted: true });
    move(100, 40);
    expect(sent).toEqual([{ yaw: -0.25, pitch: -0.1 }, { yaw: -0.5, pitch: 0.2 }]);
  });

  test("acts with a click, but not with the one that captures it", () => {
    canvas.click();
    expect(sent).toEqual([]);
    canvas.click();
    expect(sent).toEqual([{ press: "act" }]);
    Reflect.deleteProperty(document, "pointerLockElement");
    canvas.click();
    expect(sent).toHaveLength(1);
  });

  test("scrolls a row at a time, however fine the wheel is", () => {
    const wheel = (/** @type {number} */ deltaY, /** @type {number} */ deltaMode = WheelEvent.DOM_DELTA_PIXEL) =>
      send(canvas, new WheelEvent("wheel", { cancelable: true }), { deltaY, deltaMode });
    for (let i = 0; i < 5; i++) wheel(10);
    wheel(-3, WheelEvent.DOM_DELTA_LINE);
    vi.runAllTimers();
    expect(sent).toEqual([{ scroll: -1 }]);
    listening = false;
    expect(wheel(100).defaultPrevented).toBe(true); // the page does not scroll away under a dialog
    vi.runAllTimers();
    expect(sent).toHaveLength(1);
  });
});

describe("a touch screen", () => {
  const reached = vi.fn(() => true);
  beforeEach(() => connectTouch(canvas, /** @type {HTMLElement} */ (document.getElementById("touch")), inputs, listens, reached));
  const touch = (/** @type {Element | null} */ target, /** @type {string} */ type, x = 0, y = 0, pointerId = 1) =>
    target && send(target, new PointerEvent(type, { pointerType: "touch", pointerId, clientX: x, clientY: y, cancelable: true }));
  const button = (/** @type {string} */ selector) => document.querySelector(`#touch ${selector}`);

  test("looks around with one finger that is dragged over the view", () => {
    touch(canvas, "pointermove", 50, 50);
    touch(canvas, "pointerdown", 100, 100);
    touch(canvas, "pointermove", 150, 100);
    touch(canvas, "pointermove", 0, 0, 2); // of another finger
    vi.runAllTimers();
    expect(sent).toEqual([{ yaw: 0.3 }]);
  });

  test("acts on the object in reach by a tap on it, and on nothing by a drag or a tap elsewhere", () => {
    const tap = (/** @type {number} */ to) => {
      touch(canvas, "pointerdown", 100, 100);
      touch(canvas, "pointermove", to, 100);
      touch(canvas, "pointerup", to, 100);
      vi.runAllTimers();
      return sent.splice(0).filter((input) => "press" in input).length;
    };
    expect(tap(103)).toBe(1);
    expect(reached).toHaveBeenLastCalledWith(103, 100);
    expect(tap(140)).toBe(0);
    reached.mockReturnValueOnce(false);
    expect(tap(103)).toBe(0);
    listening = false;
    expect(tap(103)).toBe(0);
  });

  test("walks and turns while its buttons are held", () => {
    touch(button("[data-hold=forward]"), "pointerdown");
    touch(button("[data-hold=turnLeft]"), "pointerdown", 0, 0, 2);
    touch(button("[data-hold=forward]"), "pointerup");
    touch(button("[data-hold=turnLeft]"), "lostpointercapture");
    expect(sent).toEqual([{ forward: 1 }, { forward: 1, turn: 1 }, { turn: 1 }, {}]);
  });

  test("has buttons for hands and list", () => {
    for (const selector of ["[data-press=act]", "[data-press='left hand']", "[data-scroll='1']"]) {
      /** @type {HTMLElement} */ (button(selector)).click();
    }
    vi.runAllTimers();
    expect(sent).toEqual([{ press: "act" }, { press: "left hand" }, { scroll: 1 }]);
    listening = false;
    /** @type {HTMLElement} */ (button("[data-press=act]")).click();
    touch(button("[data-hold=forward]"), "pointerdown");
    expect(sent).toHaveLength(3);
  });
});

describe("a gamepad", () => {
  /** @type {{ mapping: string, axes: number[], buttons: { pressed: boolean }[] } | null} */
  let pad;
  beforeEach(() => {
    pad = { mapping: "standard", axes: [0, 0, 0, 0], buttons: Array.from({ length: 17 }, () => ({ pressed: false })) };
    Object.assign(navigator, { getGamepads: () => [null, pad] });
    connectGamepad(inputs, { pause, confirm, unknownPad }, listens);
    window.dispatchEvent(new Event("gamepadconnected"));
  });
  const press = (/** @type {number} */ index) => {
    for (const pressed of [true, false]) {
      if (pad) pad.buttons[index] = { pressed };
      vi.advanceTimersByTime(50);
    }
  };

  test("walks and looks with its sticks, which are still while they hardly move", () => {
    if (pad) pad.axes = [0.1, -1, 0.5, 0];
    vi.advanceTimersByTime(50);
    expect(sent).toEqual([{ forward: 1, turn: -0.4 }]);
    pad = null; // it is unplugged
    vi.advanceTimersByTime(50);
    expect(sent.at(-1)).toEqual({});
  });

  test("presses once a button", () => {
    for (const index of [0, 2, 5, 9]) press(index);
    vi.runAllTicks();
    expect(sent).toEqual([{ press: "act" }, { press: "left hand" }, { scroll: 1 }]);
    expect(pause).toHaveBeenCalledOnce();
  });

  test("of an unknown layout says so when it is used", () => {
    if (pad) [pad.mapping, pad.axes] = ["", [0, -1, 0, 0]];
    vi.advanceTimersByTime(50);
    expect(unknownPad).not.toHaveBeenCalled();
    for (const index of [0, 9]) press(index);
    expect([unknownPad.mock.calls.length, pause.mock.calls.length, sent]).toEqual([2, 0, []]);
  });

  test("confirms a dialog, and nothing else while that is open", () => {
    listening = false;
    if (pad) pad.axes = [0, -1, 0, 0];
    for (const index of [0, 2, 5]) press(index);
    expect(confirm).toHaveBeenCalledOnce();
    expect(sent).toEqual([]);
  });
});
