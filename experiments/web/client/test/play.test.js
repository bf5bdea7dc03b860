// @vitest-environment happy-dom
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";

import { REPLACED, TOO_MUCH } from "../static/protocol.js";
import { FakeSocket, TEXTS, frame, showPage, watchListeners } from "./page.js";
import { EMPTY, GAIT, SPEEDS } from "./walks.js";

// Every test reloads the page, except for these modules.
const { fake, three } = await vi.hoisted(async () => ({ fake: await import("./fake_world.js"), three: await import("../static/vendor/three.js") }));
vi.mock("../static/drawing/world.js", () => fake);
vi.mock("../static/vendor/three.js", () => three);
const { World3D, world } = fake;

const SCENE = { type: "scene", path: "/scene/1/", floor: "/floor.json", gait: GAIT, speeds: SPEEDS, field_of_view: 1.5, field_of_view_range: null, step_duration: 0.04 };
const STATE = {
  type: "snapshot", step: 0, input: 0, time: 0, busy: false, body: new Array(16).fill(0), eye: [],
  hands: [[0.3, 0.2, 1], [0.3, -0.2, 1]], held: [null, null], objects: {}, models: {}, gone: [],
};
const REACH = { object: "Mug", receptacle: null, at: [0.5, 0.5], instance: "object_00", place: [1, 2, 0] };
const HUD = {
  checklist_title: "Objects to find", checklist: [], bins: [], inventory: [null, { label: null, picture: null }],
  message: null, markers: [], rerouted: false, delivered: 2, total: 6, clock: null, pointer: null, minimap: null, scroll: 0,
};

/** @param {string} id */
const part = (id) => /** @type {HTMLElement} */ (document.getElementById(id));
const caps = () => [...part("panel-text").querySelectorAll("kbd")].map((cap) => cap.textContent);
const title = () => (/** @type {HTMLDialogElement} */ (part("panel")).open ? part("panel-title").textContent : null);
/** Chooses a button of the dialog. @param {string} label */
const choose = (label) => [...part("panel-actions").querySelectorAll("button")].find((button) => button.textContent === label)?.click();
/** @param {string} code @param {string} [type] */
const key = (code, type = "keydown") => document.activeElement?.dispatchEvent(new KeyboardEvent(type, { code, bubbles: true }));
const socket = () => FakeSocket.latest();
/** Lets time pass while the server is there. @param {number} seconds */
const wait = (seconds) => {
  for (let beat = 0; beat < 2 * seconds; beat++) {
    vi.advanceTimersByTime(500);
    socket().receive({ type: "beat" });
  }
};
const settled = () => vi.advanceTimersByTimeAsync(0);

/** Opens the page of a trial. @param {Record<string, string>} [data] */
async function opened(data = {}) {
  showPage("play", { trial: "task", objects: "6", wait: "0", draw: "server", ...data });
  await import("../static/play.js");
  if (FakeSocket.all.length) socket().onopen();
}

/** Opens the page and starts the clock. @param {Record<string, string>} [data] */
async function running(data = {}) {
  await opened(data);
  socket().state("ready");
  if (data.draw) socket().receive(SCENE);
  else socket().onmessage({ data: frame({ number: 1 }) });
  await settled();
  choose("Start");
  socket().state("running");
}

beforeEach(watchListeners);
beforeEach(() => {
  vi.useFakeTimers();
  vi.resetModules();
  vi.clearAllMocks();
  FakeSocket.all = [];
  localStorage.clear();
  history.replaceState({}, "", `/play/${"x".repeat(43)}`);
  vi.stubGlobal("WebSocket", FakeSocket);
  vi.stubGlobal("createImageBitmap", async () => ({ close() {} }));
  vi.stubGlobal("fetch", async () => new Response(JSON.stringify(EMPTY)));
  vi.spyOn(location, "reload").mockImplementation(() => {});
});
afterEach(() => {
  vi.clearAllTimers();
  vi.restoreAllMocks();
});

describe("a trial", () => {
  test("goes from loading over instructions to the task and its end", async () => {
    await opened();
    expect(title()).toBe("One moment");
    expect(socket().sent).toMatchObject([{ type: "hello", trial: "task", view: { codec: "jpeg" } }]);
    socket().state("ready");
    expect(title()).toBe("One moment"); // there is nothing to see yet
    socket().onmessage({ data: frame({ number: 1 }) });
    await settled();
    expect(part("panel-text").textContent).toContain("all 6 objects");
    expect(socket().all("seen")).toEqual([{ type: "seen", frame: 1 }]);
    choose("Start");
    expect(socket().all("run")).toEqual([{ type: "run", until: null }]);
    expect([title(), part("play").dataset.phase, document.activeElement?.id]).toEqual([null, "running", "screen"]);
    socket().state("over", "all delivered");
    expect(title()).toBe("All done");
    socket().receive({ type: "saved" });
    vi.advanceTimersByTime(2000);
    expect(location.reload).toHaveBeenCalledOnce();
  });

  test("can be loaded again when loading takes long", async () => {
    await opened();
    socket().state("ready");
    wait(19);
    expect(part("panel-actions").children).toHaveLength(0);
    wait(2);
    choose("Try again");
    expect(location.reload).toHaveBeenCalledOnce();
    socket().onmessage({ data: frame({ number: 1 }) });
    await settled();
    expect(title()).toBe("Your task");
  });

  test("shows the keys of the training, which may be skipped", async () => {
    await opened({ trial: "training" });
    socket().state("ready");
    socket().onmessage({ data: frame({ number: 1 }) });
    expect(caps()).toEqual(["W", "A", "S", "D", "←", "→", "E", "H"]);
    choose("Skip the training");
    expect(socket().all("leave")).toHaveLength(1);
  });

  test.each(["training", "task"])("shows an object, its bin and the participant's own keys before the %s", async (trial) => {
    localStorage.setItem("mjsim-keys", JSON.stringify({ act: ["Space"], help: [] }));
    await opened({ trial });
    socket().receive({ type: "pictures", pictures: { mug: "data:,mug", dish_bin: "data:,bin" }, example: { mug: "Mug", dish_bin: "Dish bin" } });
    socket().state("ready");
    socket().onmessage({ data: frame({ number: 1 }) });
    await settled();
    expect([...part("panel-text").querySelectorAll("img")].map(({ src, alt }) => [src, alt])).toEqual([["data:,mug", ""], ["data:,bin", ""]]);
    expect(part("panel-text").querySelector(".example")?.textContent).toBe("An example: Mug → Dish bin");
    expect(caps().slice(-2)).toEqual(["Space", "none"]);
  });

  test("shows a picture of the markers with a line for each kind, or neither", async () => {
    await opened({ trial: "task" });
    const message = { type: "pictures", pictures: { markers: "data:,markers" }, example: {} };
    const explained = () => part("panel-text").querySelector(".explained");
    socket().receive({ ...message, markers: ["breadcrumb", "rim", "flagpole"] });
    socket().state("ready");
    socket().onmessage({ data: frame({ number: 1 }) });
    await settled();
    expect([...(explained()?.querySelectorAll("p") ?? [])].map((line) => line.textContent)).toEqual([
      "Red dots lead to the next step.", "Flagpoles mark the objects. You see them even through walls.",
    ]);
    const picture = explained()?.querySelector("img");
    expect([picture?.src, picture?.alt]).toEqual(["data:,markers", "A room with the marks that you see in your task"]);
    socket().receive({ ...message, markers: [] });
    socket().state("ready");
    await settled();
    expect(explained()).toBeNull();
  });

  test("explains the gestures of a touch screen in words", async () => {
    vi.stubGlobal("matchMedia", () => ({ matches: true }));
    await opened();
    socket().state("ready");
    socket().onmessage({ data: frame({ number: 1 }) });
    await settled();
    expect([caps(), part("panel-text").lastChild?.textContent]).toEqual([[], TEXTS.touch_text]);
    vi.stubGlobal("matchMedia", () => ({ matches: false }));
  });

  test("is ended by hand after its time only", async () => {
    await running({ wait: "60" });
    part("end-button").click();
    expect(part("panel-text").textContent).toContain("in 60 s");
    socket().state("paused", "asked");
    choose("Continue");
    expect(title()).toBeNull();
    wait(60);
    part("end-button").click();
    choose("End this part");
    expect(socket().all("leave")).toHaveLength(1);
  });

  test("is offered again on the first page of this browser", async () => {
    await opened();
    showPage("welcome");
    vi.resetModules();
    await import("../static/start.js");
    expect(part("continue").hidden).toBe(false);
    const [main, ...others] = document.querySelectorAll("form .button, #continue .button");
    expect([main, others, document.activeElement]).toEqual([part("continue").querySelector("a"), [], main]);
    expect([...document.querySelectorAll("button, a")].indexOf(/** @type {Element} */ (main))).toBe(0);
    expect(/** @type {HTMLAnchorElement} */ (main).pathname).toBe(location.pathname);
    await import("../static/end.js");
    showPage("welcome");
    vi.resetModules();
    await import("../static/start.js");
    expect(part("continue").hidden).toBe(true);
    expect(document.querySelectorAll("form .button")).toHaveLength(1);
  });

  test("leaves nothing of a person in a browser that people share", async () => {
    await opened();
    localStorage.setItem("mjsim-settings", "{}");
    document.head.innerHTML = "<script data-forgets></script>";
    vi.resetModules();
    await import("../static/end.js");
    expect(localStorage).toHaveLength(0);
    document.head.innerHTML = "";
  });
});

describe("while the clock runs", () => {
  test("keys are sent, and nothing is held once the page is left", async () => {
    await running();
    key("KeyW");
    window.dispatchEvent(new Event("blur"));
    window.dispatchEvent(new Event("focus"));
    expect(socket().inputs.slice(-2)).toMatchObject([{ forward: 1 }, {}]);
    expect(socket().inputs.at(-1)).not.toHaveProperty("forward");
    expect(socket().all("blur")).toEqual([{ type: "blur", away: true }, { type: "blur", away: false }]);
  });

  test("the display shows what the server tells", async () => {
    await running();
    socket().receive({ type: "pictures", pictures: {}, example: {} });
    socket().receive({ type: "hud", state: HUD });
    socket().receive({ type: "moment", step: 5, clock: 61, room: "Kitchen", reach: REACH, pointer: { angle: Math.PI / 2 }, minimap: null });
    socket().onmessage({ data: frame({ number: 2, step: 4 }) });
    await settled();
    expect(part("room").textContent).toBe(""); // its frame is not on show yet
    socket().onmessage({ data: frame({ number: 3, step: 5 }) });
    await settled();
    expect(part("progress").textContent).toBe("2 / 6 put away");
    expect([part("room").textContent, part("clock").textContent]).toEqual(["Kitchen", "1:01"]);
    expect([part("pointer").hidden, part("pointer").style.left, part("pointer").style.top]).toEqual([false, "50%", "6%"]);
    socket().receive({ type: "busy", busy: true });
    expect([part("busy").hidden, part("busy").textContent]).toEqual([false, "Busy: your hands are moving"]);
    socket().receive({ type: "busy", busy: false });
    expect(part("busy").hidden).toBe(true);
    part("reach").click();
    expect(socket().inputs.at(-1)).toMatchObject({ press: "act" });
  });

  test("the display quality is reported, and shown with ?debug", async () => {
    history.replaceState({}, "", "/play/token?debug");
    await running();
    for (let number = 2; number < 32; number++) { // then the participant does not move for 4 s
      vi.advanceTimersByTime(33);
      socket().onmessage({ data: frame({ number }) });
      await settled();
    }
    vi.advanceTimersByTime(5000 - 30 * 33);
    expect(socket().all("display")).toMatchObject([{ draw: "server", frame_ms: 33, frames_per_s: 1000 / 33, renderer: "frames of the server, jpeg, 640x480" }]);
    expect([part("debug").hidden, part("debug").textContent]).toEqual([false, expect.stringContaining("fps")]);
  });

  test("P pauses and continues, also while a dialog says so", async () => {
    await running();
    key("KeyP");
    expect(socket().all("pause")).toEqual([{ type: "pause", reason: "asked" }]);
    socket().state("paused", "asked");
    expect(title()).toBe("Paused");
    key("KeyP");
    expect(title()).toBeNull();
    expect(socket().all("run")).toHaveLength(2);
    part("pause-button").click();
    expect(socket().all("pause")).toHaveLength(2);
  });

  test("a page that is hidden for long is paused", async () => {
    await running();
    const hide = (/** @type {boolean} */ hidden) => {
      vi.spyOn(document, "hidden", "get").mockReturnValue(hidden);
      document.dispatchEvent(new Event("visibilitychange"));
    };
    hide(true);
    wait(4);
    hide(false);
    wait(6);
    expect(socket().all("pause")).toEqual([]);
    hide(true);
    wait(6);
    expect(socket().all("pause")).toEqual([{ type: "pause", reason: "hidden" }]);
    expect(socket().all("beat")).toHaveLength(32);
    socket().state("paused", "hidden");
    hide(false);
    hide(true);
    wait(6);
    expect(socket().all("pause")).toHaveLength(1);
  });

  test("H opens and closes the table of controls, under which no key walks", async () => {
    await running();
    const help = /** @type {HTMLDialogElement} */ (part("help"));
    key("KeyH");
    expect([help.open, part("keys").children.length]).toEqual([true, 15]);
    key("KeyW");
    expect(socket().inputs.some((input) => input.forward)).toBe(false);
    key("KeyH");
    expect([help.open, document.activeElement?.id]).toEqual([false, "screen"]);
    part("help-button").click();
    expect(help.open).toBe(true);
  });

  test("a new size of the window is reported once it is stable", async () => {
    await running();
    part("screen").getBoundingClientRect = () => new DOMRect(0, 0, 320, 240);
    window.dispatchEvent(new Event("resize"));
    window.dispatchEvent(new Event("resize"));
    vi.advanceTimersByTime(500);
    expect(socket().all("view")).toEqual([{ type: "view", width: 320, height: 240, codec: "jpeg" }]);
  });

  test("settings change mouse and text", async () => {
    await running();
    const text = /** @type {HTMLSelectElement} */ (document.querySelector("[name=text]"));
    text.value = "1.5";
    text.dispatchEvent(new Event("change"));
    expect(document.documentElement.style.fontSize).toBe("150%");
  });
});

describe("the clock never runs behind a dialog", () => {
  /** @param {string} reason */
  const stopped = (reason) => {
    expect(socket().all("pause")).toEqual([{ type: "pause", reason }]);
    socket().state("paused", reason);
  };

  test("help stops it, and closing the help starts it", async () => {
    await running();
    part("help-button").click();
    stopped("asked");
    wait(5);
    expect([/** @type {HTMLDialogElement} */ (part("help")).open, title(), part("play").dataset.phase]).toEqual([true, null, "paused"]);
    part("help-close").click();
    expect([title(), socket().all("run").length]).toEqual([null, 2]);
  });

  test("help that is closed before the server has stopped the clock starts it as soon as it has", async () => {
    await running();
    part("help-button").click();
    part("help-close").click();
    expect(socket().all("run")).toHaveLength(1);
    stopped("asked");
    expect([title(), socket().all("run").length]).toEqual([null, 2]);
  });

  test("P after help that was closed at once pauses, although the server has not answered yet", async () => {
    await running();
    part("help-button").click();
    part("help-close").click();
    key("KeyP");
    stopped("asked");
    expect([title(), socket().all("run").length]).toEqual(["Paused", 1]);
  });

  test("a lost picture stops it for as long as it takes to return", async () => {
    await running({ draw: "browser" });
    world.onLost();
    expect(title()).toBe("One moment");
    stopped("picture lost");
    wait(4.5);
    expect(title()).toBe("One moment");
    world.onRestored();
    expect([title(), socket().all("run").length]).toEqual([null, 2]);
    wait(5);
    expect([title(), socket().all("draw")]).toEqual([null, []]);
  });

  test("a pause does not count as slow drawing", async () => {
    await running({ draw: "auto" });
    key("KeyP");
    stopped("asked");
    wait(12);
    choose("Continue");
    expect(socket().all("draw")).toEqual([]);
  });

  test("a state from the server does not hide that the picture is lost", async () => {
    await running({ draw: "browser" });
    world.onLost();
    socket().state("running");
    expect(title()).toBe("One moment");
  });
});

test("a page that was replaced says so for as long as it is open", async () => {
  await running();
  socket().receive({ type: "replaced" });
  socket().onclose({ code: REPLACED });
  for (let second = 0; second < 5; second++) {
    vi.advanceTimersByTime(1000);
    expect(title()).toBe("This session continues on another page");
  }
  expect(FakeSocket.all).toHaveLength(1);
  choose("Continue here");
  expect(location.reload).toHaveBeenCalledOnce();
});

test("a key held through a lost connection still walks afterwards", async () => {
  await running();
  key("KeyW");
  socket().onclose({ code: 1006 });
  vi.advanceTimersByTime(900);
  socket().state("paused", "disconnected", 1);
  const types = socket().sent.map(({ type }) => type);
  expect(types.lastIndexOf("inputs")).toBeGreaterThan(types.indexOf("run")); // earlier ones count as released
  expect(socket().inputs.at(-1)).toMatchObject({ forward: 1 });
});

describe("a lost link", () => {
  test("pauses, and the clock runs again by itself when it is back", async () => {
    await running();
    socket().onclose({ code: 1006 });
    expect([title(), part("play").dataset.phase]).toEqual(["No connection", "loading"]);
    vi.advanceTimersByTime(900);
    expect(FakeSocket.all).toHaveLength(2);
    socket().onopen();
    socket().state("paused", "disconnected");
    expect(title()).toBeNull();
    expect(socket().all("run")).toHaveLength(1);
  });

  test("is noticed although nothing closed it", async () => {
    await running();
    vi.advanceTimersByTime(2000);
    expect(title()).toBe("No connection");
    socket().receive({ type: "beat" });
    expect(socket().all("pause")).toEqual([{ type: "pause", reason: "silent" }]);
    socket().state("paused", "silent");
    expect(socket().all("run")).toHaveLength(2);
  });

  test("does not let the clock run while the page is hidden", async () => {
    await running();
    vi.spyOn(document, "hidden", "get").mockReturnValue(true);
    socket().onclose({ code: 1006 });
    vi.advanceTimersByTime(900);
    socket().state("paused", "disconnected");
    expect([title(), socket().all("run")]).toEqual(["Paused", []]);
  });
});

test.each([
  [{ type: "occupied" }, "This session is open on another page", "Continue here"],
  [{ type: "replaced" }, "This session continues on another page", "Continue here"],
  [{ type: "error", code: "idle", message: "" }, "You were away for a long time", "Continue"],
  [{ type: "state", phase: "failed", reason: "The disk is full", input: 0 }, "Something went wrong", "Try again"],
  [{ type: "state", phase: "paused", reason: "taken over", input: 0 }, "Paused", "Continue"],
])("the page says what it waits for: %o", async (message, expected, label) => {
  await opened();
  socket().onmessage({ data: frame({ number: 1 }) });
  socket().receive(message);
  expect(title()).toBe(expected);
  expect(part("panel-actions").querySelector("button")?.textContent ?? null).toBe(label);
});

test("a session that is open in another page can be taken over", async () => {
  await opened();
  socket().receive({ type: "occupied" });
  choose("Continue here");
  expect(socket().all("takeover")).toHaveLength(1);
  socket().onclose({ code: TOO_MUCH });
  expect(title()).toBe("The connection was closed");
  choose("Reconnect");
  expect(location.reload).toHaveBeenCalledOnce();
});

test("a message that the server refused is left in the console, for those who look for a fault", async () => {
  const warned = vi.spyOn(console, "warn").mockImplementation(() => {});
  await opened();
  socket().receive({ type: "error", code: "malformed", message: "no such key" });
  expect(warned.mock.lastCall?.[0]).toContain("no such key");
});

describe("a browser that draws", () => {
  test("walks ahead of the server, and tells the steps of its inputs", async () => {
    await running({ draw: "auto" });
    expect(socket().sent[0].view.codec).toBe("none");
    expect(socket().all("run")).toEqual([{ type: "run", until: 0 }]);
    expect(part("world").hidden).toBe(false);
    socket().receive(STATE);
    key("KeyW");
    vi.advanceTimersByTime(200);
    expect(world.camera.setEye.mock.lastCall?.[0].position[0]).toBeGreaterThan(0.1);
    expect(socket().inputs.find((input) => input.forward)).toMatchObject({ step: 0 });
    expect(socket().all("inputs").at(-1).until).toBeGreaterThanOrEqual(4);
  });

  test("says that a pick waits for the server", async () => {
    await running({ draw: "auto" });
    socket().receive(STATE);
    socket().receive({ type: "moment", step: 0, clock: null, room: "", reach: REACH, pointer: null, minimap: null });
    socket().receive({ type: "markers", markers: [] });
    key("KeyE");
    expect([part("busy").textContent, part("busy").className]).toEqual(["One moment", "asked"]);
    vi.advanceTimersByTime(100);
    const press = socket().inputs.find((input) => input.press === "act");
    expect(part("reach").style.getPropertyValue("--x")).toBe("0.25"); // where the object is drawn
    socket().receive({ ...STATE, step: 1 }); // of before the press
    expect(part("busy").textContent).toBe("One moment");
    socket().receive({ ...STATE, step: 2, busy: true });
    expect(part("busy").textContent).toBe("Busy: your hands are moving");
    socket().receive({ ...STATE, step: 14, input: press.number });
    expect(part("busy").hidden).toBe(true);
  });

  test("keeps drawing while it is fast enough", async () => {
    await running({ draw: "auto" });
    for (let step = 0; step < 250; step++) {
      vi.advanceTimersByTime(40);
      socket().receive({ ...STATE, step });
    }
    expect(socket().all("display")).toMatchObject([{ draw: "browser" }, { draw: "browser", renderer: "a card" }]);
    expect(socket().all("draw")).toEqual([]);
  });

  test.each([
    ["context lost", () => (world.onLost(), wait(5))],
    ["slow", () => wait(5)],
  ])("lets the server draw where it cannot: %s", async (reason, happens) => {
    await running({ draw: "auto" });
    if (reason === "slow") {
      // The state comes, but there are no pictures.
      vi.stubGlobal("requestAnimationFrame", () => 0);
      wait(5);
      expect(socket().all("draw")).toEqual([{ type: "draw", draw: "browser", reason: "slow: 70 % of the resolution" }]);
    }
    happens();
    expect(socket().all("draw").at(-1)).toEqual({ type: "draw", draw: "server", reason });
    expect(socket().all("view")).toMatchObject([{ codec: "jpeg" }]);
    expect([part("world").hidden, part("redraw-button").hidden, part("server-draws").hidden]).toEqual([true, false, false]);
    expect(title()).toBe("One moment"); // there is no frame yet
    socket().state("paused", "picture lost");
    socket().onmessage({ data: frame({ number: 1 }) });
    await settled();
    expect([title(), socket().all("run").length]).toEqual([null, 2]);
  });

  describe("with a choice of the field of view", () => {
    const CHOICE = { ...SCENE, field_of_view_range: [1.2, 2] };
    const slider = () => /** @type {HTMLInputElement} */ (document.querySelector("[name=degrees]"));
    /** @param {string} degrees */
    const slide = (degrees) => {
      slider().value = degrees;
      slider().dispatchEvent(new Event("change"));
    };

    test("offers it only where the study does", async () => {
      await running({ draw: "auto" });
      expect(part("field-of-view").hidden).toBe(true);
      socket().receive(CHOICE);
      expect(part("field-of-view").hidden).toBe(false);
      expect([slider().min, slider().max, slider().value]).toEqual(["69", "114", "86"]);
      expect(socket().all("view")).toEqual([]);
      world.onLost();
      wait(5);
      expect(part("field-of-view").hidden).toBe(true);
    });

    test("asks for it, shows what the server allows, and remembers it", async () => {
      await running({ draw: "auto" });
      socket().receive(CHOICE);
      slide("100");
      expect(socket().all("view")).toMatchObject([{ codec: "none", field_of_view: expect.closeTo(1.745, 3) }]);
      socket().receive({ ...CHOICE, field_of_view: 1.745 });
      await settled();
      expect(world.setFieldOfView).toHaveBeenLastCalledWith(1.745);
      expect(part("field-of-view").textContent).toContain("100°");
      for (let step = 0; step < 125; step++) {
        vi.advanceTimersByTime(40);
        socket().receive({ ...STATE, step });
      }
      expect(socket().all("display")).toMatchObject([{ field_of_view: 1.745 }]);
      vi.resetModules();
      await opened({ draw: "auto" });
      expect(socket().sent[0].view.field_of_view).toBeCloseTo(1.745, 3);
    });
  });

  test("lets the server draw a house that it cannot load", async () => {
    world.load.mockRejectedValueOnce(new Error("house.glb: 404"));
    await opened({ draw: "auto" });
    socket().receive(SCENE);
    await settled();
    expect(socket().all("draw")).toMatchObject([{ reason: "house not loaded: house.glb: 404" }]);
  });

  test("is not replaced where the study wants the browser to draw", async () => {
    await running({ draw: "browser" });
    world.onLost();
    wait(5);
    expect([title(), socket().all("draw")]).toEqual(["This browser cannot draw the apartment", []]);
    choose("Try again");
    expect(location.reload).toHaveBeenCalledOnce();
  });

  test.each([["browser", 0, "This browser cannot draw the apartment"], ["auto", 1, "One moment"]])(
    "without WebGL 2 there is a reason or frames: %s", async (draw, sockets, expected) => {
      World3D.mockImplementationOnce(function () {
        throw new Error("no WebGL 2");
      });
      await opened({ draw });
      expect([FakeSocket.all.length, title()]).toEqual([sockets, expected]);
      if (sockets) expect(socket().sent[0].view.codec).toBe("jpeg");
    },
  );
});
