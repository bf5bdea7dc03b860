// Measures the computer and fills the page's form.

import { byId, within } from "../dom.js";
import { World3D } from "../drawing/world.js";
import { COARSER, SLOWEST, resolution } from "../picture.js";

const TRIPS = 5; // number of round trips to the server
const MEASURED = 1500; // duration of the frame rate measurement, in ms
const KEY = "KeyW";
const EYE_HEIGHT = 1.6; // m

const form = byId("device", HTMLFormElement);
const state = byId("state", HTMLElement);

/** @param {string} name @param {string} shown @param {Record<string, string>} values */
function tell(name, shown, values) {
  within(form, `[data-result=${name}]`, HTMLElement).textContent = shown;
  for (const [key, value] of Object.entries(values)) within(form, `[name=${key}]`, HTMLInputElement).value = value;
}

function measureWebgl() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const info = gl?.getExtension("WEBGL_debug_renderer_info");
  const renderer = gl ? String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER)) : "";
  tell("webgl", gl ? "✓" : "–", { webgl: gl ? "yes" : "", renderer });
}

function measureScreen() {
  const [width, height] = [window.innerWidth, window.innerHeight];
  tell("screen", `${width} × ${height}`, {
    width: String(width), height: String(height), pixel_ratio: String(window.devicePixelRatio || 1),
  });
}

/** Loads the apartment, or returns null if this fails. @param {HTMLCanvasElement} canvas */
async function apartment(canvas) {
  try {
    const world = new World3D(canvas);
    const { rooms } = await world.load((name) => (canvas.dataset["scene"] ?? "") + name);
    /** Draws the view after a share of a walk through all rooms. @param {number} share */
    const draw = (share) => {
      const polygon = rooms[Math.floor(share * rooms.length)]?.polygon ?? [];
      const [x, y] = [0, 1].map((axis) => polygon.reduce((sum, point) => sum + (point[axis] ?? 0) / polygon.length, 0));
      world.camera.setEye({ position: [x ?? 0, y ?? 0, EYE_HEIGHT], heading: 2 * Math.PI * share * rooms.length, pitch: 0 });
      world.draw();
    };
    return { world, draw };
  } catch {
    return null;
  }
}

/** Measures the frame rate as a trial would draw, with a lower resolution if necessary. */
async function measureFrames() {
  const canvas = byId("apartment", HTMLCanvasElement);
  const view = await apartment(canvas);
  let rate = 0;
  for (const scale of [1, COARSER]) {
    view?.world.resize(resolution(scale));
    view?.draw(0); // the first frame takes longer
    const began = await nextFrame();
    let [frames, now] = [0, began];
    while (now - began < MEASURED) {
      view?.draw((now - began) / MEASURED);
      now = await nextFrame();
      frames++;
    }
    rate = (1000 * frames) / (now - began);
    if (rate >= SLOWEST) break;
  }
  canvas.remove();
  tell("frames", rate.toFixed(0), { frames_per_s: rate.toFixed(1) });
}

/** @returns {Promise<number>} time of the next frame, in ms */
const nextFrame = () => new Promise((resolve) => requestAnimationFrame(resolve));

async function measureLatency() {
  /** @type {number[]} */
  const trips = [];
  for (let i = 0; i < TRIPS; i++) {
    const began = performance.now();
    await fetch(form.dataset["ping"] ?? "", { cache: "no-store" });
    trips.push(performance.now() - began);
  }
  const median = trips.sort((a, b) => a - b)[Math.floor(TRIPS / 2)] ?? Infinity;
  tell("latency", `${median.toFixed(0)} ms`, { latency_ms: median.toFixed(1) });
}

function waitForKey() {
  if (form.dataset["keyboard"] !== "yes") return Promise.resolve();
  state.textContent = state.dataset["key"] ?? "";
  return new Promise((resolve) => {
    addEventListener("keydown", function pressed({ code }) {
      if (code !== KEY) return;
      removeEventListener("keydown", pressed);
      resolve(undefined);
    });
  }).then(() => tell("keyboard", "✓", { keyboard: "yes" }));
}

state.textContent = state.dataset["running"] ?? "";
measureWebgl();
measureScreen();
addEventListener("resize", measureScreen);
await measureFrames();
await measureLatency().catch(() => tell("latency", "–", { latency_ms: "999999" }));
for (const button of form.querySelectorAll("button")) if (button.name) button.disabled = false;
await waitForKey();
state.textContent = "";
for (const button of form.querySelectorAll("button")) button.disabled = false;
within(form, ".button", HTMLButtonElement).focus();
