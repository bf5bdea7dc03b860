// The page of `mjsim view`: plays a recorded run, from any camera, at any speed.

/** @import { Marker } from "../protocol.js" */
/** @import { Moment, Recorded } from "./run.js" */

import { byId, made } from "../dom.js";
import { World3D } from "../drawing/world.js";
import { HeadsetPage } from "../headset.js";
import { Hud } from "../hud.js";
import { eyeOf } from "../prediction/body.js";
import { Orbit } from "./orbit.js";
import { Run } from "./run.js";
import { dots, figure } from "./figure.js";

const AFTER = 0.05; // s after an event, when the HUD shows it

const canvas = byId("screen", HTMLCanvasElement);
const slider = byId("time", HTMLInputElement);
const speed = byId("speed", HTMLSelectElement);
const paths = byId("paths", HTMLInputElement);
const play = byId("run", HTMLButtonElement);
const cameras = /** @type {HTMLElement[]} */ ([...document.querySelectorAll("[data-camera]")]);

/** @type {Recorded} */
const recorded = await unpacked("run-data");
/** @type {Record<string, string>} */
const files = await unpacked("scene-data");
const run = new Run(recorded);
const hud = new Hud(() => "E");
const world = new World3D(canvas);
const notice = byId("debug", HTMLElement);
const headset = new HeadsetPage(world, null);
const orbit = new Orbit(canvas, recorded.bounds);
/** @type {"person" | "above" | "free"} */
let camera = "person";
let playing = false;
let resumes = false; // whether to play on once a lost drawing context is back
let time = 0;
let last = performance.now();
let shown = -1; // control step whose HUD is shown

/** @param {string} id of an element with compressed JSON in base64 */
async function unpacked(id) {
  const bytes = Uint8Array.from(atob(byId(id, HTMLScriptElement).text), (letter) => letter.charCodeAt(0));
  const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(plain).json();
}

/** @param {number} now ms */
function show(now) {
  if (playing) {
    time = Math.min(run.duration, time + (Number(speed.value) * (now - last)) / 1000);
    if (time === run.duration) setPlaying(false);
  }
  last = now;
  draw();
}

function draw() {
  const { step, share } = run.at(time);
  const [x = 0, y = 0, heading = 0, pitch = 0] = run.body(step, share);
  for (const { name, pose } of run.poses(step, share)) world.setPose(name, pose);
  world.setPerson({ x, y, heading, hands: run.hands(step, share), eyeHeight: recorded.person.eye_height });
  const eye = eyeOf([x, y, heading, pitch], recorded.person);
  if (headset.place(eye.position)) headset.show(run.hud(step), run.hud(step).clock);
  else if (camera === "person") world.camera.setEye(eye);
  else world.camera.setFree(camera === "above" ? orbit.above() : orbit.pose());
  if (step !== shown) showStep(step, x, y, heading);
  slider.value = `${time}`;
  byId("seconds", HTMLOutputElement).textContent = `${time.toFixed(1)} / ${run.duration.toFixed(1)} s`;
  world.draw();
}

/** @param {number} step @param {number} x @param {number} y @param {number} heading */
function showStep(step, x, y, heading) {
  shown = step;
  const state = run.hud(step);
  const plan = run.plan(time);
  hud.show(state);
  hud.showMoment({ type: "moment", step, clock: state.clock, room: "", reach: null, pointer: camera === "person" ? state.pointer : null, minimap: null });
  byId("plan", HTMLElement).textContent = plan ? `Plan: ${plan.cost_m.toFixed(1)} m, ${plan.status}` : "";
  /** @type {Marker[]} */
  const markers = [...run.markers(step)];
  if (camera !== "person") {
    markers.push(...figure(x, y, heading, recorded.person));
    if (paths.checked) markers.push(...dots(run.walked(step), "walked"), ...(plan ? dots(plan.path, "planned") : []));
  }
  world.setMarkers(markers);
  const moments = [...byId("moments", HTMLElement).children];
  const latest = moments.findLast((item) => Number(item.getAttribute("data-t")) <= time);
  for (const item of moments) item.setAttribute("aria-current", item === latest ? "step" : "false");
}

/** @param {boolean} on */
function setPlaying(on) {
  if (on && time === run.duration) time = 0;
  playing = on;
  play.textContent = on ? "Pause" : "Play";
}

/** @param {number} to s */
function seek(to) {
  time = Math.min(run.duration, Math.max(0, to));
  shown = -1;
}

/** @param {typeof camera} name */
function setCamera(name) {
  camera = name;
  shown = -1;
  world.showCeilings(name === "person");
  for (const button of cameras) button.setAttribute("aria-pressed", `${button.dataset.camera === name}`);
}

/** @param {Moment} moment */
function listed(moment) {
  const row = document.createElement("li");
  const button = document.createElement("button");
  button.type = "button";
  button.append(made("time", `${moment.t.toFixed(1)} s`), made("span", moment.text));
  button.addEventListener("click", () => seek(moment.t + AFTER));
  row.dataset.t = `${moment.t}`;
  row.className = moment.kind;
  row.append(button);
  return row;
}

/** @param {Moment} moment */
function tick(moment) {
  const mark = made("i", "");
  mark.className = moment.kind;
  mark.style.left = `${(100 * moment.t) / run.duration}%`;
  return mark;
}

world.onLost = () => {
  resumes = playing;
  setPlaying(false);
  notice.textContent = "The browser stopped drawing. If it does not continue in a few seconds, reload the page.";
};
world.onRestored = () => {
  notice.textContent = "";
  setPlaying(resumes);
};
slider.max = `${run.duration}`;
slider.addEventListener("input", () => seek(Number(slider.value)));
play.addEventListener("click", () => setPlaying(!playing));
paths.addEventListener("change", () => seek(time));
canvas.addEventListener("keydown", (event) => {
  const turned = camera === "free" && orbit.key(event.key);
  if (event.code === "Space") setPlaying(!playing);
  else if (event.code === "ArrowRight" && !turned) seek(time + 1);
  else if (event.code === "ArrowLeft" && !turned) seek(time - 1);
  else if (!turned) return;
  event.preventDefault();
});
for (const button of cameras) button.addEventListener("click", () => setCamera(/** @type {typeof camera} */ (button.dataset.camera)));
byId("moments", HTMLElement).append(...recorded.moments.map(listed));
byId("ticks", HTMLElement).append(...recorded.moments.map(tick));
hud.learn({ type: "pictures", pictures: recorded.pictures, example: {}, markers: [] });
new ResizeObserver(() => world.resize()).observe(canvas);
await world.load((name) => files[name] ?? name);
await world.setObjects(
  Object.fromEntries([...run.poses(0, 0)].map(({ name, pose }) => [name, { model: recorded.models[name] ?? "", pose }])),
);
world.setFieldOfView(recorded.person.field_of_view);
notice.textContent = "";
setCamera(/** @type {typeof camera} */ (byId("play", HTMLElement).dataset.cameraFirst || "person"));
world.resize();
headset.offer(byId("headset-button", HTMLElement), () => run.body(run.at(time).step, 0)[2] ?? 0);
world.onFrame(show);
