// @vitest-environment happy-dom
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";

vi.mock("../static/drawing/world.js", async () => import("./fake_world.js"));

describe("study form", () => {
  const sent = vi.fn(async () => new Response(null, { status: 204 }));
  beforeEach(async () => {
    vi.useFakeTimers();
    vi.resetModules();
    sent.mockClear();
    vi.stubGlobal("fetch", sent);
    document.body.innerHTML = `<form data-save="/play/x/answers"><input type="hidden" name="phase" value="survey">
      <input type="radio" name="useful" value="2"><textarea name="comments"></textarea></form>`;
    await import("../static/study/form.js");
  });
  afterEach(() => vi.useRealTimers());

  const body = () => Object.fromEntries(/** @type {any} */ (sent.mock.lastCall)?.[1].body);

  test("a choice is saved immediately", () => {
    const radio = /** @type {HTMLInputElement} */ (document.querySelector("[name=useful]"));
    radio.checked = true;
    radio.dispatchEvent(new Event("change", { bubbles: true }));
    expect(body()).toMatchObject({ phase: "survey", useful: "2" });
  });

  test("text is saved when the participant stops typing", () => {
    const text = /** @type {HTMLTextAreaElement} */ (document.querySelector("[name=comments]"));
    for (const words of ["s", "so", "so far"]) {
      text.value = words;
      text.dispatchEvent(new Event("input", { bubbles: true }));
      vi.advanceTimersByTime(100);
    }
    expect(sent).not.toHaveBeenCalled();
    vi.advanceTimersByTime(1000);
    expect(sent).toHaveBeenCalledTimes(1);
    expect(body().comments).toBe("so far");
  });

  test("nothing is saved after the form has been submitted", () => {
    const [form, text] = [document.querySelector("form"), document.querySelector("textarea")];
    text?.dispatchEvent(new Event("input", { bubbles: true }));
    form?.dispatchEvent(new Event("submit"));
    vi.advanceTimersByTime(1000);
    expect(sent).not.toHaveBeenCalled();
  });
});

describe("device check", () => {
  beforeEach(() => {
    vi.resetModules();
    vi.stubGlobal("requestAnimationFrame", (/** @type {FrameRequestCallback} */ next) => setTimeout(() => next(performance.now()), 16));
    const names = ["webgl", "renderer", "frames_per_s", "latency_ms", "width", "height", "pixel_ratio", "keyboard"];
    document.body.innerHTML = `<form id="device" data-ping="/ping" data-keyboard="yes"><p id="state" data-running="Checking" data-key="Press W"></p>
      <canvas id="apartment" data-scene="/scene/1/"></canvas>
      ${["webgl", "frames", "latency", "keyboard", "screen"].map((name) => `<b data-result="${name}"></b>`).join("")}
      ${names.map((name) => `<input type="hidden" name="${name}">`).join("")}
      <button class="button" disabled>Continue</button><button name="give_up" disabled>No</button></form>`;
  });
  const value = (/** @type {string} */ name) => /** @type {HTMLInputElement} */ (document.querySelector(`[name=${name}]`)).value;
  const button = () => /** @type {HTMLButtonElement} */ (document.querySelector(".button"));

  test("the participant can continue after the measurements and the requested key", async () => {
    vi.stubGlobal("fetch", async () => new Response(null, { status: 204 }));
    const checked = import("../static/study/device.js");
    await vi.waitFor(() => expect(document.body.textContent).toContain("Press W"), 5000);
    expect(button().disabled).toBe(true);
    window.dispatchEvent(new KeyboardEvent("keydown", { code: "KeyQ" }));
    expect(value("keyboard")).toBe("");
    window.dispatchEvent(new KeyboardEvent("keydown", { code: "KeyW" }));
    await checked;
    expect(button().disabled).toBe(false);
    expect(value("keyboard")).toBe("yes");
    expect(Number(value("frames_per_s"))).toBeGreaterThan(10);
    expect(Number(value("latency_ms"))).toBeLessThan(1000);
    expect(value("width")).toBe(String(window.innerWidth));
    expect(value("webgl")).toBe(""); // the test environment has no WebGL
  });

  /** Frame rate that is measured if each frame of the apartment takes as long, in ms. @param {number} frame */
  async function measured(frame) {
    vi.stubGlobal("fetch", async () => new Response(null, { status: 204 }));
    let now = 0;
    vi.stubGlobal("requestAnimationFrame", (/** @type {FrameRequestCallback} */ next) => setTimeout(() => next((now += frame))));
    const { world } = /** @type {typeof import("./fake_world.js")} */ (/** @type {unknown} */ (await import("../static/drawing/world.js")));
    vi.clearAllMocks();
    void import("../static/study/device.js");
    await vi.waitFor(() => expect(document.body.textContent).toContain("Press W"), 5000);
    return { rate: Number(value("frames_per_s")), world };
  }

  test("the frame rate is that of a walk through the rooms of the apartment", async () => {
    const { rate, world } = await measured(25);
    expect(rate).toBe(40);
    expect(await world.load.mock.results[0]?.value).toHaveProperty("file", "/scene/1/scene.json");
    expect(world.draw).toHaveBeenCalledTimes(61);
    const places = world.camera.setEye.mock.calls.map(([{ position }]) => position.join(" "));
    expect(new Set(places)).toEqual(new Set(["1 1 1.6", "5 1 1.6"]));
    expect(document.getElementById("apartment")).toBeNull();
  });

  test("a slow picture is drawn with a lower resolution, as in a trial", async () => {
    const { rate, world } = await measured(100);
    expect(rate).toBe(10);
    expect(world.resize.mock.calls).toEqual([[1], [0.7]]);
  });

  test("a failed connection is recorded as a very long latency", async () => {
    vi.stubGlobal("fetch", async () => {
      throw new TypeError("no network");
    });
    const checked = import("../static/study/device.js");
    await vi.waitFor(() => expect(document.body.textContent).toContain("Press W"), 5000);
    window.dispatchEvent(new KeyboardEvent("keydown", { code: "KeyW" }));
    await checked;
    expect(value("latency_ms")).toBe("999999");
  });
});

describe("the first page", () => {
  const shown = async (/** @type {{ touch: boolean, keyboard: string, width: number }} */ { touch, keyboard, width }) => {
    vi.resetModules();
    vi.stubGlobal("matchMedia", () => ({ matches: touch }));
    vi.stubGlobal("screen", { width, height: Math.round(width / 2) });
    document.body.innerHTML = `<p id="unsuitable" data-width="800" data-keyboard="${keyboard}" hidden></p>`;
    await import("../static/study/suitable.js");
    return !(/** @type {HTMLElement} */ (document.getElementById("unsuitable")).hidden);
  };

  test("says that a phone cannot take part, and says nothing on a computer", async () => {
    expect(await shown({ touch: true, keyboard: "yes", width: 844 })).toBe(true);
    expect(await shown({ touch: true, keyboard: "no", width: 700 })).toBe(true);
    expect(await shown({ touch: true, keyboard: "no", width: 1024 })).toBe(false);
    expect(await shown({ touch: false, keyboard: "yes", width: 1280 })).toBe(false);
  });
});

test("the researcher page refreshes its live numbers and keeps everything else", async () => {
  vi.useFakeTimers();
  vi.stubGlobal("fetch", async () => new Response(`<p id="people" data-live>2</p><input id="wanted" value="3">`));
  document.body.innerHTML = `<p id="people" data-live>1</p><input id="wanted" value="4">`;
  await import("../static/study/refresh.js");
  await vi.advanceTimersByTimeAsync(6000);
  expect(document.getElementById("people")?.textContent).toBe("2");
  expect(/** @type {HTMLInputElement} */ (document.getElementById("wanted")).value).toBe("4");
  vi.useRealTimers();
});

describe("film", () => {
  const value = (/** @type {string} */ name) => /** @type {HTMLInputElement} */ (document.querySelector(`[name=${name}]`)).value;
  /** @param {string} required @param {Record<string, unknown>} film */
  async function submitted(required, film) {
    vi.resetModules();
    document.body.innerHTML = `<form><video ${required}></video><button id="play-film" type="button" hidden></button><p id="unplayed" hidden></p>
      ${["played_s", "film_s", "film_error"].map((name) => `<input type="hidden" name="${name}">`).join("")}</form>`;
    const ranges = { length: 2, start: (/** @type {number} */ i) => [0, 50][i], end: (/** @type {number} */ i) => [40, 80][i] };
    const video = document.querySelector("video");
    for (const [name, made] of Object.entries({ played: ranges, duration: 100, error: null, ...film })) Object.defineProperty(video, name, { value: made });
    await import("../static/study/film.js");
    const event = new Event("submit", { cancelable: true });
    document.querySelector("form")?.dispatchEvent(event);
    return [event.defaultPrevented, document.getElementById("unplayed")?.hidden];
  }

  test("starts with a button, which is hidden once the film plays or cannot be played", async () => {
    for (const event of ["play", "error"]) {
      await submitted("", {});
      const [video, button] = [document.querySelector("video"), document.getElementById("play-film")];
      if (!video || !button) throw new Error("no film");
      const play = vi.spyOn(video, "play").mockResolvedValue();
      expect(button.hidden).toBe(false);
      button.click();
      expect(play).toHaveBeenCalledOnce();
      video.dispatchEvent(new Event(event));
      expect(button.hidden).toBe(true);
    }
  });

  test("reports how much was played", async () => {
    expect(await submitted("", {})).toEqual([false, true]);
    expect([value("played_s"), value("film_s"), value("film_error")]).toEqual(["70.0", "100.0", ""]);
  });

  test("asks for a required film to be played to its end, unless the browser cannot play it", async () => {
    expect(await submitted("data-required", {})).toEqual([true, false]);
    expect(await submitted("data-required", { duration: 72 })).toEqual([false, true]);
    expect(await submitted("data-required", { error: { code: 4 }, duration: NaN })).toEqual([false, true]);
    expect([value("film_s"), value("film_error")]).toEqual(["", "4"]);
  });
});
