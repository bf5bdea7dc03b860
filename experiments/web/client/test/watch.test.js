// @vitest-environment happy-dom
import { afterAll, beforeAll, expect, test, vi } from "vitest";

import { world } from "./fake_world.js";
import { FakeSocket, showPage } from "./page.js";

vi.mock("../static/drawing/world.js", () => import("./fake_world.js"));

const GAIT = { dt: 0.04, eye_height: 1.6, eye_forward: 0.06 };
const SCENE = { type: "scene", path: "/scene/1/", floor: null, gait: GAIT, speeds: {}, field_of_view: 1.5, field_of_view_range: null, step_duration: 0.04 };
const SNAPSHOT = {
  type: "snapshot", step: 7, input: 0, time: 0.28, busy: false, body: [1, 2, 0, 0], eye: [], hands: [[0, 0, 0], [0, 0, 0]], held: [null, null],
  objects: { cup: [1, 1, 1, 1, 0, 0, 0] }, models: { cup: "mug" }, gone: [],
};

/** @param {string} id */
const part = (id) => /** @type {any} */ (document.getElementById(id));
/** @param {object} message */
const say = (message) => FakeSocket.latest().onmessage({ data: JSON.stringify(message) });
const later = (ms = 20) => vi.advanceTimersByTimeAsync(ms);

beforeAll(async () => {
  vi.useFakeTimers();
  vi.stubGlobal("WebSocket", FakeSocket);
  showPage("researcher/watch");
  part("note").textContent = "p00001: connecting";
  await import("../static/study/watch.js");
});
afterAll(() => vi.useRealTimers());

test("the participant's phase and view are shown, including snapshots received while loading", async () => {
  say({ type: "state", phase: "running", reason: "", input: 0 });
  say(SCENE);
  say(SNAPSHOT);
  expect([part("play").dataset.phase, part("note").textContent, part("world").hidden]).toEqual(["running", "p00001: loading the apartment", false]);
  await later();
  expect(part("note").textContent).toBe("p00001");
  expect(world.setObjects.mock.lastCall).toEqual([{ cup: { model: "mug", pose: SNAPSHOT.objects.cup } }]);
  await later();
  expect(world.camera.setEye.mock.lastCall?.[0].position).toEqual([1.06, 2, 1.6]);
});

test("the page reconnects after the connection closes, and never sends anything", async () => {
  const socket = FakeSocket.latest();
  socket.onclose({ code: 1006 });
  expect(part("note").textContent).toContain("reconnects");
  await later(3000);
  expect(FakeSocket.latest()).not.toBe(socket);
  say({ type: "state", phase: "paused", reason: "asked", input: 0 });
  expect(part("note").textContent).toBe("p00001: paused");
  expect(FakeSocket.all.flatMap(({ sent }) => sent)).toEqual([]);
});
