// @vitest-environment happy-dom
import { beforeEach, describe, expect, test, vi } from "vitest";

import { HeadsetPage } from "../static/headset.js";
import { Inputs } from "../static/inputs.js";
import { Group, PerspectiveCamera } from "../static/vendor/three.js";
import { giveTexts } from "./page.js";

/** @import { World3D } from "../static/drawing/world.js" */
/** @import { HudState } from "../static/protocol.js" */

/** A headset with two controllers. */
class Session extends EventTarget {
  inputSources = ["left", "right"].map((handedness) => ({ handedness, gamepad: { axes: [0, 0, 0, 0], buttons: Array.from({ length: 6 }, () => ({ pressed: false })) } }));

  /** @param {number} side 0 for the left controller @param {number} button @param {boolean} pressed */
  press(side, button, pressed) {
    const pad = this.inputSources[side]?.gamepad;
    if (pad) pad.buttons[button] = { pressed };
  }

  /** @param {number} side @param {number} x @param {number} y */
  push(side, x, y) {
    const pad = this.inputSources[side]?.gamepad;
    if (pad) pad.axes = [0, 0, x, y];
  }
}

const renderer = { xr: { enabled: false, setReferenceSpaceType: vi.fn(), setSession: vi.fn() } };
const resize = vi.fn();
/** @type {any[]} */
let sent;
/** @type {Session} */
let session;
/** @type {Group} */
let scene;
/** @type {PerspectiveCamera} */
let camera;
/** @type {HeadsetPage} */
let page;
const button = document.createElement("button");
const EYE = [2, 3, 1.6];

beforeEach(async () => {
  vi.clearAllMocks();
  vi.useFakeTimers();
  [session, scene, camera, sent] = [new Session(), new Group(), new PerspectiveCamera(), []];
  Object.assign(navigator, { xr: { isSessionSupported: async () => true, requestSession: async () => session } });
  const world = /** @type {World3D} */ (/** @type {unknown} */ ({ stage: { renderer, scene, camera }, resize }));
  page = new HeadsetPage(world, new Inputs((input) => sent.push(input)));
});

/** Starts a headset session while the person looks north. */
async function worn() {
  const own = /** @type {HTMLElement} */ (button.cloneNode());
  await page.offer(own, () => Math.PI / 2);
  own.click();
  await vi.advanceTimersByTimeAsync(0);
}

/** Draws a frame and returns the inputs that were sent with it. @returns {any[]} */
function picture() {
  sent.length = 0;
  page.place(EYE);
  scene.updateMatrixWorld(true);
  vi.advanceTimersByTime(50);
  return sent.filter((input) => Object.keys(input).length > 0);
}

test("the headset button is shown only if a headset is available", async () => {
  await page.offer(button, () => 0);
  expect(button.hidden).toBe(false);
  Object.assign(navigator, { xr: undefined });
  await page.offer(button, () => 0);
  expect([button.hidden, page.place(EYE)]).toEqual([true, false]);
});

describe("while the headset is worn", () => {
  test("the person keeps their position and viewing direction when the headset starts", async () => {
    await worn();
    picture();
    expect(camera.getWorldPosition(camera.position.clone()).toArray()).toEqual([2, 1.6, -3]);
    expect(camera.getWorldDirection(camera.position.clone()).z).toBeCloseTo(-1); // looks north
  });

  test("turning the head turns the person", async () => {
    await worn();
    picture();
    camera.rotation.set(0.2, 0.3, 0, "YXZ");
    expect(picture()).toEqual([{ yaw: expect.closeTo(0.3), pitch: expect.closeTo(0.2) }]);
    expect(picture()).toEqual([]); // each movement counts once
  });

  test("the left stick walks, and each push of the right stick turns once", async () => {
    await worn();
    picture();
    session.push(0, 0.1, -1);
    session.push(1, 0.9, 0);
    expect(picture()).toEqual([{ forward: 1 }]);
    const yaws = [picture(), picture(), picture()].flat().map((input) => input.yaw ?? 0);
    expect(yaws).toEqual([expect.closeTo(-Math.PI / 6), 0, 0]);
  });

  test("a trigger uses the hand on its side, once for each press", async () => {
    await worn();
    picture();
    session.press(0, 0, true);
    expect(picture()).toEqual([{ press: "left hand" }]);
    expect(picture()).toEqual([]);
    session.press(0, 0, false);
    session.press(1, 4, true);
    expect(picture()).toEqual([{ press: "act" }]);
  });

  test("the panel shows the task and scrolls to the current row", async () => {
    /** @type {string[]} */
    const written = [];
    const context = { fillRect() {}, fillText: (/** @type {string} */ text) => written.push(text) };
    const getContext = vi.spyOn(HTMLCanvasElement.prototype, "getContext").mockImplementation(/** @type {any} */ (() => context));
    const item = (/** @type {number} */ number) =>
      ({ text: `Object ${number}`, detail: "Kitchen\n→ Bin", number, done: number < 5, carried: number === 4, current: number === 5, picture: null, target_picture: null });
    const hud = /** @type {HudState} */ ({
      checklist_title: "Plan", checklist: [1, 2, 3, 4, 5, 6, 7, 8, 9, 10].map(item), bins: [{ label: "Bin", place: "Kitchen\nleft", picture: null }],
      inventory: [{ label: "Mug", picture: null }, { label: null, picture: null }], message: { text: "Picked up", kind: "info", opacity: 1 },
      markers: [], rerouted: false, delivered: 4, total: 10, clock: null, pointer: null, minimap: null, scroll: 0,
    });
    giveTexts();
    page.show(hud, 61);
    expect(written).toEqual([]); // the panel is drawn only while the headset is worn
    await worn();
    page.show(hud, 61);
    getContext.mockRestore();
    expect(written.slice(0, 2)).toEqual(["4 / 10 put away  |  1:01  |  Picked up", "Plan"]);
    expect(written.slice(2, 5)).toEqual(["In your hand: Object 4   Kitchen → Bin", "5. Object 5   Kitchen → Bin", "6. Object 6   Kitchen → Bin"]);
    expect(written.slice(-2)).toEqual(["Left hand: Mug   Right hand: empty", "Bin: Kitchen left"]);
  });
});

test("taking the headset off restores the page and releases all inputs", async () => {
  await worn();
  session.push(0, 0, -1);
  picture();
  session.dispatchEvent(new Event("end"));
  expect([renderer.xr.enabled, camera.parent]).toEqual([false, null]);
  expect(resize).toHaveBeenCalled();
  expect(sent.at(-1)).toEqual({});
  expect(page.place(EYE)).toBe(false);
});
