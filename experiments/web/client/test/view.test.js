// @vitest-environment happy-dom
import { describe, expect, test } from "vitest";

import { dots, figure } from "../static/view/figure.js";
import { Orbit } from "../static/view/orbit.js";
import { Run } from "../static/view/run.js";

/** @import { HudState, Marker } from "../static/protocol.js" */

const CRUMB = /** @type {Marker} */ ({ shape: "sphere", role: "breadcrumb" });
const POLE = /** @type {Marker} */ ({ shape: "cylinder", role: "flagpole" });
const EMPTY = /** @type {HudState} */ ({ delivered: 0 });
const FULL = /** @type {HudState} */ ({ delivered: 1 });

const run = new Run({
  person: { eye_height: 1.6, eye_forward: 0.06, body_radius: 0.2, field_of_view: 1.5 }, bounds: [0, 0, 8, 6],
  models: { cup: "mug" },
  time: [0, 0.04, 0.08, 0.12],
  body: [0, 0, 3.1, 0, 0.1, 0, -3.1, 0.2, 0.2, 0, -3.1, 0.2, 0.3, 0, -3.1, 0.2],
  hands: [0.3, 0.2, 1, 0.3, -0.2, 1, 0.5, 0.2, 1, 0.3, -0.2, 1, 0.5, 0.2, 1, 0.3, -0.2, 1, 0.5, 0.2, 1, 0.3, -0.2, 1],
  objects: { cup: [0, 1, 1, 1, 1, 0, 0, 0, 2, 2, 1, 1, -1, 0, 0, 0] },
  hud: [[0, EMPTY], [2, FULL]],
  markers: [CRUMB, POLE],
  shown: [[0, [0, 1]], [3, [1]]],
  moments: [], plans: [{ t: 0, cost_m: 9, status: "feasible", path: [] }, { t: 0.1, cost_m: 8, status: "optimal", path: [] }],
  pictures: {},
});

describe("recorded run", () => {
  test("every time corresponds to a control step", () => {
    expect(run.at(0.06)).toEqual({ step: 1, share: expect.closeTo(0.5) });
    expect(run.at(99)).toEqual({ step: 3, share: 0 });
    expect(run.duration).toBe(0.12);
  });

  test("headings are interpolated in the shorter direction", () => {
    expect(run.body(0, 0.5)[2]).toBeCloseTo(Math.PI, 2);
    expect(run.body(3, 0.5)).toEqual([0.3, 0, -3.1, 0.2]);
  });

  test("an object moves only during the step before its next recorded pose", () => {
    const pose = (/** @type {number} */ step, /** @type {number} */ share) => [...run.poses(step, share)][0]?.pose;
    expect(pose(0, 0.9)?.[0]).toBe(1);
    expect(pose(1, 0.5)?.[0]).toBe(1.5);
    expect(pose(1, 0.5)?.[3]).toBe(1); // the same orientation with the opposite sign
    expect(pose(3, 0)?.[0]).toBe(2);
  });

  test("the latest recorded HUD, markers and plan are shown", () => {
    expect(run.hud(1)).toBe(EMPTY);
    expect(run.hud(3)).toBe(FULL);
    expect(run.markers(2)).toEqual([CRUMB, POLE]);
    expect(run.markers(3)).toEqual([POLE]);
    expect(run.plan(0.05)?.cost_m).toBe(9);
    expect(run.plan(0.1)?.cost_m).toBe(8);
    expect(run.hands(0, 0.5)[0]?.[0]).toBeCloseTo(0.4);
    expect(run.walked(2)).toEqual([0, 0, 0.1, 0, 0.2, 0]);
  });
});

describe("view from outside", () => {
  test("the figure of the person shows their heading", () => {
    const nose = figure(1, 2, Math.PI / 2, run.recorded.person).at(-1);
    expect(nose?.position[1]).toBeCloseTo(2.15);
  });

  test("the dots of a path are equally spaced around corners", () => {
    const found = dots([0, 0, 1.1, 0, 1.1, 1], "walked").map((marker) => marker.position);
    expect(found).toHaveLength(9);
    expect(found[4]?.[0]).toBeCloseTo(1);
    expect(found[5]?.[1]).toBeCloseTo(0.15);
  });

  test("the camera turns and moves by dragging and zooms with the wheel", () => {
    const canvas = document.createElement("canvas");
    const orbit = new Orbit(canvas, [0, 0, 8, 6]);
    const before = orbit.pose();
    const drag = (/** @type {number} */ buttons) => {
      const event = new PointerEvent("pointermove", { buttons });
      Object.defineProperties(event, { movementX: { value: 40 }, movementY: { value: 10 } });
      canvas.dispatchEvent(event);
    };
    drag(1);
    expect(orbit.pose().position[0]).not.toBeCloseTo(before.position[0]);
    expect(orbit.pose().target).toEqual(before.target);
    drag(2);
    expect(orbit.pose().target).not.toEqual(before.target);
    const distance = () => Math.hypot(...orbit.pose().position.map((value, i) => value - (orbit.pose().target[i] ?? 0)));
    const far = distance();
    canvas.dispatchEvent(new WheelEvent("wheel", { deltaY: -400, cancelable: true }));
    expect(distance()).toBeLessThan(far);
    expect(orbit.above().position[2]).toBeGreaterThan(10);
  });
});
