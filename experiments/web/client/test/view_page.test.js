// @vitest-environment happy-dom
import { beforeAll, expect, test, vi } from "vitest";

import { world } from "./fake_world.js";
import { packed, showPage } from "./page.js";

/** @import { Marker } from "../static/protocol.js" */

vi.mock("../static/drawing/world.js", () => import("./fake_world.js"));

/** @param {number} delivered @param {number} clock */
const hud = (delivered, clock) => ({
  checklist_title: "Objects", checklist: [], bins: [], inventory: [null, { label: null, picture: null }], message: null, markers: [],
  rerouted: false, delivered, total: 2, clock, pointer: null, minimap: null, scroll: 0,
});
const STEPS = 100; // number of steps of 0.1 s
const steps = Array.from({ length: STEPS + 1 }, (_, k) => k);
const RUN = {
  person: { eye_height: 1.6, eye_forward: 0.06, body_radius: 0.2, field_of_view: 1.5 }, bounds: [0, 0, 8, 6],
  models: { cup: "mug" }, time: steps.map((k) => k / 10), body: steps.flatMap((k) => [k / 100, 0, 0, 0]),
  hands: steps.flatMap(() => [0.3, 0.2, 1, 0.3, -0.2, 1]), objects: { cup: [0, 1, 1, 1, 1, 0, 0, 0] },
  hud: [[0, hud(0, 0)], [50, hud(1, 5)]], markers: [{ shape: "sphere", role: "breadcrumb" }], shown: [[0, [0]]],
  moments: [{ t: 2, kind: "pick", text: "Picked up Blue mug" }, { t: 5, kind: "place", text: "Put it away" }],
  plans: [{ t: 0, cost_m: 9.04, status: "optimal", path: [0, 0, 1, 0] }], pictures: {},
};

/** @param {string} id */
const part = (id) => /** @type {any} */ (document.getElementById(id));
/** Advances the time so that the next frame is drawn. @param {number} [ms] */
const later = (ms = 20) => vi.advanceTimersByTime(ms);
const markers = () => /** @type {Marker[]} */ (world.setMarkers.mock.lastCall?.[0]);

/** @param {string} name */
const camera = (name) => {
  /** @type {HTMLElement} */ (document.querySelector(`[data-camera=${name}]`)).click();
  later();
};

/** @type {any} */
let told; // arguments with which the world was loaded
beforeAll(async () => {
  vi.useFakeTimers({ toFake: ["performance", "requestAnimationFrame"] });
  showPage("view");
  for (const [id, value] of Object.entries({ "run-data": RUN, "scene-data": { "house.glb": "data:,house" } })) {
    document.body.append(Object.assign(document.createElement("script"), { id, type: "application/octet-stream", textContent: packed(value) }));
  }
  await import("../static/view/view.js");
  told = { load: world.load.mock.lastCall, setObjects: world.setObjects.mock.lastCall, setFieldOfView: world.setFieldOfView.mock.lastCall };
});

test("a run is shown from its start in first person without loading other files", () => {
  expect(told.load[0]("house.glb")).toBe("data:,house");
  expect(told.setObjects).toEqual([{ cup: { model: "mug", pose: [1, 1, 1, 1, 0, 0, 0] } }]);
  expect(told.setFieldOfView).toEqual([1.5]);
  later();
  expect(world.camera.setEye.mock.lastCall?.[0].position).toEqual([0.06, 0, 1.6]);
  expect([part("progress").textContent, part("plan").textContent]).toEqual(["0 / 2 put away", "Plan: 9.0 m, optimal"]);
  expect(part("seconds").textContent).toBe("0.0 / 10.0 s");
  expect(markers()).toEqual(RUN.markers);
});

test("a run plays to its end at the chosen speed and can be replayed", () => {
  part("speed").value = "4";
  part("run").click();
  expect(part("run").textContent).toBe("Pause");
  later(1000);
  expect(part("seconds").textContent).toBe("4.0 / 10.0 s");
  expect(world.setPerson.mock.lastCall?.[0].x).toBeCloseTo(0.4);
  later(2000);
  expect([part("run").textContent, part("seconds").textContent, part("progress").textContent]).toEqual(["Play", "10.0 / 10.0 s", "1 / 2 put away"]);
  part("run").click();
  later(100);
  expect(part("seconds").textContent).toBe("0.4 / 10.0 s");
  part("run").click();
});

test("clicking an event jumps to its time", () => {
  expect([...part("ticks").children].map((tick) => tick.style.left)).toEqual(["20%", "50%"]);
  part("moments").children[1].querySelector("button").click();
  later();
  expect([part("time").value, part("progress").textContent]).toEqual(["5.05", "1 / 2 put away"]);
  expect([...part("moments").children].map((item) => item.getAttribute("aria-current"))).toEqual(["false", "step"]);
});

test("the slider and the arrow keys change the time", () => {
  const key = (/** @type {string} */ code) => part("screen").dispatchEvent(new KeyboardEvent("keydown", { code, cancelable: true }));
  part("time").value = "3";
  part("time").dispatchEvent(new Event("input"));
  key("ArrowRight");
  later();
  expect(part("time").value).toBe("4");
  key("ArrowLeft");
  key("ArrowLeft");
  later();
  expect(part("time").value).toBe("2");
  key("Space");
  expect(part("run").textContent).toBe("Pause");
  key("Space");
  expect(key("KeyX")).toBe(true); // other keys are left to the browser
});

test("the view from above shows the person and both paths but no ceilings", () => {
  camera("above");
  expect(world.showCeilings).toHaveBeenLastCalledWith(false);
  expect(world.camera.setFree.mock.lastCall?.[0].position[2]).toBeGreaterThan(5);
  expect(document.querySelector("[data-camera=above]")?.getAttribute("aria-pressed")).toBe("true");
  const shapes = markers().map(({ shape }) => shape);
  expect(shapes).toContain("cylinder"); // the person's body
  part("paths").checked = false;
  part("paths").dispatchEvent(new Event("change"));
  later();
  expect(markers().length).toBeLessThan(shapes.length);
  camera("free");
  expect(world.camera.setFree.mock.lastCall?.[0].fovy).toBeCloseTo((50 * Math.PI) / 180);
  const pose = () => world.camera.setFree.mock.lastCall?.[0].position;
  const [before, at] = [pose(), part("time").value];
  for (const key of ["ArrowLeft", "+"]) part("screen").dispatchEvent(new KeyboardEvent("keydown", { key, code: key }));
  later();
  expect(Math.hypot(...pose())).toBeLessThan(Math.hypot(...before));
  expect([pose()[0] === before[0], part("time").value]).toEqual([false, at]); // the camera has turned and the time has not changed
  camera("person");
  expect(markers()).toEqual(RUN.markers);
});

test("a lost drawing context pauses the run and says so until the context returns", () => {
  part("time").value = "0";
  part("time").dispatchEvent(new Event("input"));
  part("run").click();
  later(1000);
  world.onLost();
  expect([part("run").textContent, part("debug").textContent]).toEqual(["Play", expect.stringContaining("reload the page")]);
  const seconds = part("seconds").textContent;
  later(1000);
  expect(part("seconds").textContent).toBe(seconds);
  world.onRestored();
  expect([part("run").textContent, part("debug").textContent]).toEqual(["Pause", ""]);
  later(1000);
  expect(part("seconds").textContent).not.toBe(seconds);
  part("run").click();
  world.onLost();
  world.onRestored();
  expect(part("run").textContent).toBe("Play");
});
