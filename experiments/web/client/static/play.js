// The page on which a trial is played: joins view, controls, connection and dialogs.

/** @import { Codec, PauseReason, View } from "./protocol.js" */
/** @import { Received } from "./connection.js" */

import { Bindings, learnLayout } from "./bindings.js";
import { Connection } from "./connection.js";
import * as dialogs from "./dialogs.js";
import { byId } from "./dom.js";
import { connectGamepad } from "./gamepad.js";
import { Help } from "./help.js";
import { Hud } from "./hud.js";
import { Inputs } from "./inputs.js";
import { Keyboard } from "./keyboard.js";
import { Meter } from "./meter.js";
import { Panel } from "./panel.js";
import { connectMouse, connectTouch } from "./pointer.js";
import { BEAT_PERIOD, DISPLAY_PERIOD, MAX_SILENCE, TOO_MUCH } from "./protocol.js";
import { Screen, bestCodec } from "./screen.js";
import { Session } from "./session.js";
import { rememberVisit } from "./visit.js";

const HIDDEN_GRACE = 5000; // ms that the page may be hidden before the session is paused
const DONE = 1500; // ms for which the end of a trial is shown
const RESIZED = 300; // ms after which a new size of the page is sent

const page = byId("play", HTMLElement);
const { trial = "", objects = "", wait = "0" } = page.dataset;
const endable = performance.now() + 1000 * Number(wait); // when the trial may be ended by hand, ms
const canvas = byId("screen", HTMLCanvasElement);
const tab = Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16)).join("-");

const session = new Session();
/** @type {Codec} */
let codec = "jpeg";
let renderer = "";
let silent = false; // whether the link was lost without being closed
const panel = new Panel(
  byId("panel", HTMLDialogElement),
  {
    run,
    leave: () => connection.send({ type: "leave" }),
    hide: () => panel.hide(),
    takeover: () => connection.send({ type: "takeover" }),
    reload: () => location.reload(),
  },
  () => canvas.focus(),
);
const meter = new Meter();
const screen = new Screen(
  canvas,
  (frame) => {
    connection.send({ type: "seen", frame: frame.number });
    meter.shown(frame);
    renderer = `frames of the server, ${frame.codec}, ${frame.width}x${frame.height}`;
    hud.reached(frame.step);
  },
  () => {
    codec = "jpeg";
    sendView();
  },
);
/** @returns {View} */
const view = () => ({ type: "view", ...screen.size, codec });
const connection = new Connection(() => ({ type: "hello", tab, trial, view: view() }), take);
const inputs = new Inputs((input) => meter.sent(connection.input(input)));
const bindings = new Bindings();
const hud = new Hud(() => bindings.label("act"));
const help = new Help(byId("help", HTMLDialogElement), bindings, () => canvas.focus());
const commands = {
  help: () => (help.open ? help.hide() : openHelp()),
  pause: () => (session.phase === "paused" ? run() : pause("asked")),
  confirm: () => /** @type {HTMLElement | null} */ (document.querySelector("dialog[open] .button"))?.click(),
};
const listens = () => session.phase === "running" && !panel.open && !help.open;
const keyboard = new Keyboard(bindings, inputs, commands, listens);

/** @param {Received} message */
function take(message) {
  if (silent && message.type !== "closed") {
    silent = false;
    connection.send({ type: "pause", reason: "silent" }); // the state that follows lets the clock run again
  }
  switch (message.type) {
    case "state":
      session.take(message);
      showState();
      break;
    case "frame":
      meter.came(message);
      screen.show(message);
      if (session.phase === "ready") showInstructions(); // there is something to see now
      break;
    case "pictures":
      hud.learn(message);
      break;
    case "hud":
      hud.show(message.state);
      break;
    case "moment":
      hud.expect(message);
      break;
    case "beat":
      if (session.phase === "running") connection.send({ type: "beat" }); // not by a timer: those of hidden pages are slow
      break;
    case "busy":
      byId("busy", HTMLElement).hidden = !message.busy;
      break;
    case "saved":
      connection.close();
      panel.show(dialogs.over(session.reason, true));
      setTimeout(() => location.reload(), DONE);
      break;
    case "queue":
      panel.show(dialogs.queue(message.position));
      break;
    case "occupied":
      panel.show(dialogs.OCCUPIED);
      break;
    case "replaced":
      panel.show(dialogs.REPLACED);
      break;
    case "error":
      if (message.code === "idle") panel.show(dialogs.IDLE);
      else console.warn(`the server refused a message (${message.code}): ${message.message}`);
      break;
    case "closed":
      screen.reset();
      silent = false;
      if (!message.final) lose();
      else if (message.code === TOO_MUCH) panel.show(dialogs.CLOSED);
  }
}

function showState() {
  page.dataset.phase = session.phase; // the style sheet hides what belongs to the task while the clock does not run
  switch (session.phase) {
    case "loading":
      panel.show(dialogs.loading(session.interrupted));
      break;
    case "running":
      inputs.repeat();
      panel.hide();
      break;
    case "paused":
      if (session.interrupted && !document.hidden) run();
      else {
        if (document.pointerLockElement) document.exitPointerLock();
        panel.show(dialogs.paused(session.reason));
      }
      break;
    case "over":
      panel.show(dialogs.over(session.reason, false));
      break;
    case "failed":
      connection.close();
      panel.show(dialogs.failed(session.reason));
  }
}

function lose() {
  release();
  session.lose();
  showState();
  panel.show(dialogs.OFFLINE);
}

function watchLink() {
  if (session.phase !== "running" || connection.silence < 1000 * MAX_SILENCE) return;
  silent = true;
  lose();
}

function report() {
  const { kilobits, ...seen } = meter.take();
  const { width, height } = canvas.getBoundingClientRect();
  const size = { width: Math.max(1, Math.round(width)), height: Math.max(1, Math.round(height)) };
  if (session.phase === "running" && renderer) {
    connection.send({ type: "display", renderer, ...size, pixel_ratio: window.devicePixelRatio || 1, ...seen });
  }
  byId("debug", HTMLElement).textContent =
    `${seen.latency_ms ?? "–"} ms · ${seen.frames_per_s} fps · ${kilobits} kbit/s · ${renderer} · ${connection.pending} not taken`;
}

function showInstructions() {
  const touch = matchMedia("(pointer: coarse)").matches;
  const controls = touch ? dialogs.TOUCH_CONTROLS : dialogs.keyControls((name) => bindings.label(name));
  const dialog = dialogs.instructions(trial, Number(objects), controls, performance.now() >= endable);
  if (panel.title !== dialog.title) panel.show(dialog);
}

function run() {
  if (!session.run()) return;
  showState();
  connection.send({ type: "run" });
}

/** @param {PauseReason} reason */
function pause(reason) {
  if (session.phase !== "running") return;
  release();
  connection.send({ type: "pause", reason });
}

function askToEnd() {
  release();
  panel.show(dialogs.ending(trial, Math.ceil((endable - performance.now()) / 1000)));
}

function openHelp() {
  release();
  if (document.pointerLockElement) document.exitPointerLock();
  help.show();
}

function release() {
  keyboard.release();
  inputs.release();
}

function sendView() {
  screen.reset();
  connection.send(view());
}

function watchPage() {
  let hidden = 0;
  document.addEventListener("visibilitychange", () => {
    clearTimeout(hidden);
    if (!document.hidden) return;
    release();
    hidden = window.setTimeout(() => pause("hidden"), HIDDEN_GRACE);
  });
  window.addEventListener("blur", () => {
    release();
    connection.send({ type: "blur", away: true });
  });
  window.addEventListener("focus", () => connection.send({ type: "blur", away: false }));
  window.addEventListener("pagehide", () => connection.close());
  let resized = 0;
  window.addEventListener("resize", () => {
    clearTimeout(resized);
    resized = window.setTimeout(sendView, RESIZED);
  });
}

byId("panel", HTMLDialogElement).addEventListener("keydown", (event) => {
  if (session.phase !== "paused" || bindings.action(event.code)?.name !== "pause") return;
  event.stopPropagation(); // else the view, which listens again, pauses anew
  run();
});
byId("help-button", HTMLElement).addEventListener("click", openHelp);
byId("pause-button", HTMLElement).addEventListener("click", () => commands.pause());
byId("end-button", HTMLElement).addEventListener("click", askToEnd);
byId("reach", HTMLElement).addEventListener("click", () => {
  if (listens()) inputs.press("act");
  canvas.focus();
});
const full = byId("full-button", HTMLElement);
full.hidden = !document.fullscreenEnabled;
full.addEventListener("click", () => {
  if (document.fullscreenElement) document.exitFullscreen();
  else document.documentElement.requestFullscreen();
});
connectMouse(canvas, inputs, listens, () => hud.reach);
connectTouch(canvas, byId("touch", HTMLElement), inputs, listens);
connectGamepad(inputs, commands, listens);
watchPage();
setInterval(watchLink, 1000 * BEAT_PERIOD);
setInterval(report, 1000 * DISPLAY_PERIOD);
byId("debug", HTMLElement).hidden = !new URLSearchParams(location.search).has("debug");
rememberVisit();
panel.show(dialogs.loading(false));
learnLayout();
codec = await bestCodec();
connection.open();
