// Measures the computer and fills the page's form.

import { byId, within } from "../dom.js";

const TRIPS = 5; // number of round trips to the server
const MEASURED = 1500; // duration of the frame rate measurement, in ms
const KEY = "KeyW";

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

async function measureFrames() {
  const began = performance.now();
  let frames = 0;
  let now = began;
  while (now - began < MEASURED) {
    now = await new Promise((resolve) => requestAnimationFrame(resolve));
    frames++;
  }
  const rate = (1000 * frames) / (now - began);
  tell("frames", rate.toFixed(0), { frames_per_s: rate.toFixed(1) });
}

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
