import { beforeEach, describe, expect, test, vi } from "vitest";

import { DrawnView } from "../static/drawn_view.js";
import { MAX_STEPS_AHEAD } from "../static/protocol.js";
import { EMPTY, GAIT, SPEEDS } from "./walks.js";

/** @import { SceneMessage, Snapshot } from "../static/protocol.js" */

const world = vi.hoisted(() => ({
  load: vi.fn(async () => ({ objects: { mug: {} } })), loadModels: vi.fn(), setFieldOfView: vi.fn(), resize: vi.fn(),
  setObjects: vi.fn(), setPose: vi.fn(), setPerson: vi.fn(), setMarkers: vi.fn(), setOutline: vi.fn(),
  draw: vi.fn(), camera: { setEye: vi.fn(), locate: vi.fn(() => ({ x: 0.25, y: 0.5, inView: true })) }, onLost: () => {},
}));
vi.mock("../static/drawing/world.js", () => ({ World3D: vi.fn(function () { return world; }) }));

/** @type {SceneMessage} */
const SCENE = {
  type: "scene", path: "/scene/1/", floor: "/scene/1/floor.json", gait: GAIT, speeds: SPEEDS, field_of_view: 1.5, field_of_view_range: null, step_duration: 0.04,
};
/** @param {Partial<Snapshot>} more @returns {Snapshot} */
const state = (more) => ({
  type: "snapshot", step: 0, input: 0, time: 0, busy: false, body: new Array(16).fill(0), eye: [], hands: [[0.3, 0.2, 1], [0.3, -0.2, 1]],
  held: [null, null], objects: {}, models: {}, gone: [], ...more,
});

describe("a view that this browser draws", () => {
  /** @type {number[]} */
  let sent;
  /** @type {DrawnView} */
  let view;
  beforeEach(async () => {
    vi.clearAllMocks();
    vi.stubGlobal("fetch", async () => new Response(JSON.stringify(EMPTY)));
    sent = [];
    view = new DrawnView(/** @type {HTMLCanvasElement} */ ({}), (until) => sent.push(until));
    await view.load(SCENE);
  });

  test("loads a house once", async () => {
    await view.load(SCENE);
    expect(world.load).toHaveBeenCalledTimes(1);
    expect(world.loadModels).toHaveBeenCalledWith(["mug"]);
  });

  test("loads a house once if the same scene arrives twice", async () => {
    world.load.mockClear();
    const other = new DrawnView(/** @type {HTMLCanvasElement} */ ({}), () => {});
    await Promise.all([other.load(SCENE), other.load(SCENE)]);
    expect(world.load).toHaveBeenCalledTimes(1);
  });

  test("loads another house after the one that was expected", async () => {
    const [other, order] = [new DrawnView(/** @type {HTMLCanvasElement} */ ({}), () => {}), /** @type {string[]} */ ([])];
    world.load.mockImplementation(/** @param {any} resolve */ async (...resolve) => {
      const path = /** @type {any} */ (resolve[0])("");
      order.push(path);
      await Promise.resolve();
      order.push(`${path} is there`);
      if (path !== SCENE.path) throw new Error("no such house");
      return { objects: { mug: {} } };
    });
    other.prepare("/scene/0/");
    await other.load(SCENE);
    expect(order).toEqual(["/scene/0/", "/scene/0/ is there", "/scene/1/", "/scene/1/ is there"]);
  });

  test("says why there is no floor", async () => {
    vi.stubGlobal("fetch", async () => new Response("", { status: 404 }));
    await expect(view.load(SCENE)).rejects.toThrow("floor.json: 404");
  });

  test("draws nothing before there is a state", () => {
    expect(view.draw(0)).toBeNull();
  });

  test("counts control steps from when the clock was started, not from the first state", () => {
    view.begin(1000);
    view.take(state({ step: 0 }), 1205); // the way there and back took 205 ms
    expect(sent).toEqual([1, 2, 3, 4, 5]);
    expect(view.step).toBe(5);
    view.tick(1241);
    expect(sent.at(-1)).toBe(6);
  });

  test("forgets objects when another scene arrives, as after a resize", async () => {
    view.take(state({ objects: { a: [0, 0, 0, 1, 0, 0, 0], b: [1, 0, 0, 1, 0, 0, 0] }, models: { a: "mug", b: "mug" } }), 10);
    await view.load(SCENE);
    view.take(state({ step: 1, objects: { b: [2, 0, 0, 1, 0, 0, 0] }, models: { b: "mug" } }), 50);
    expect(Object.keys(world.setObjects.mock.lastCall?.[0] ?? {})).toEqual(["b"]);
  });

  test("waits for a server that is behind", () => {
    view.begin(0);
    view.take(state({}), 10);
    for (let now = 10; now < 3000; now += 20) view.tick(now);
    expect(sent.at(-1)).toBe(MAX_STEPS_AHEAD);
    view.take(state({ step: 3 }), 3000);
    for (let now = 3000; now < 4000; now += 20) view.tick(now);
    expect(sent.at(-1)).toBe(3 + MAX_STEPS_AHEAD);
  });

  test("leaves out the steps in which the page was asleep", () => {
    view.begin(0);
    view.take(state({}), 10);
    view.tick(60_000);
    expect(sent.length).toBeLessThan(5);
  });

  test("walks at once, and the eye with it", () => {
    view.begin(0);
    view.take(state({}), 10);
    view.draw(20);
    view.add({ number: 1, forward: 1, step: view.step });
    view.draw(39);
    const [eye] = world.camera.setEye.mock.lastCall ?? [];
    expect(eye.position[0]).toBeGreaterThan(GAIT.eye_forward);
  });

  test("shows what the server says while the clock is stopped", () => {
    view.begin(0);
    view.take(state({}), 10);
    view.end();
    view.take(state({ body: [1, 2, ...new Array(14).fill(0)] }), 100);
    const drawn = view.draw(120);
    expect(Array.from(drawn?.body ?? []).slice(0, 2)).toEqual([1, 2]);
    expect(view.step).toBeNull();
  });

  test("knows of an object from when it enters until it is gone", () => {
    view.take(state({ objects: { cup: [1, 1, 1, 1, 0, 0, 0] }, models: { cup: "mug" } }), 0);
    expect(Object.keys(world.setObjects.mock.lastCall?.[0])).toEqual(["cup"]);
    view.draw(100);
    expect(world.setPose).toHaveBeenCalledWith("cup", [1, 1, 1, 1, 0, 0, 0]);
    view.take(state({ gone: ["cup"] }), 200);
    expect(Object.keys(world.setObjects.mock.lastCall?.[0])).toEqual([]);
  });

  test("outlines what E would take, and says where it is", () => {
    view.take(state({}), 0);
    view.outline({ object: "Mug", instance: "cup", receptacle: null, place: [1, 2, 3], at: null });
    expect(world.setOutline).toHaveBeenCalledWith("cup");
    expect(view.draw(10)?.reach).toEqual([0.25, 0.5]);
    view.outline(null);
    expect(view.draw(20)?.reach).toBeNull();
  });

  test("turns in steps where less motion is wanted", () => {
    view.calm = true;
    view.take(state({ body: [0, 0, 0.3, ...new Array(13).fill(0)] }), 0);
    view.draw(10);
    expect(world.camera.setEye.mock.lastCall?.[0].heading).toBeCloseTo(Math.PI / 8);
  });
});
