// The page on which a trial is played: joins view, controls, connection and dialogs.

/** @import { PauseReason, State } from "./protocol.js" */
/** @import { Received } from "./connection.js" */
/** @import { PageState, Shown } from "./page_state.js" */

import { Bindings, learnLayout } from "./bindings.js";
import { Connection } from "./connection.js";
import * as dialogs from "./dialogs.js";
import { byId } from "./dom.js";
import { connectGamepad } from "./gamepad.js";
import { HeadsetPage } from "./headset.js";
import { Help } from "./help.js";
import { Hud } from "./hud.js";
import { Inputs } from "./inputs.js";
import { connectKeyboard } from "./keyboard.js";
import { isStill } from "./meter.js";
import { watchPage } from "./page_events.js";
import { pauseReason, resumes, shownIn } from "./page_state.js";
import { Panel } from "./panel.js";
import { Picture } from "./picture.js";
import { connectMouse, connectTouch } from "./pointer.js";
import { BEAT_PERIOD, DISPLAY_PERIOD } from "./protocol.js";
import { Session } from "./session.js";
import { Settings } from "./settings.js";
import { Sounds } from "./sounds.js";
import { textOf } from "./texts.js";
import { rememberVisit } from "./visit.js";

const DONE = 1500; // how long the end of a trial is shown, in ms
const LATE = 20_000; // loading time after which the participant is offered to load the page again, in ms
const NOTICE = 8000; // how long a notice is shown, in ms
const TICK = 20; // timer period in ms, since animation frames stop in background pages

const page = byId("play", HTMLElement);
const { trial = "", objects = "", wait = "0", draw = "auto" } = page.dataset;
const endable = performance.now() + 1000 * Number(wait); // time from which the trial may be ended by hand, in ms
const canvas = byId("screen", HTMLCanvasElement);
const tab = Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16)).join("-");

const session = new Session();
let pressed = 0; // last input with a press, whose effect the server decides
let stopping = false; // true until the server confirms a pause
let saved = false; // true once the run is complete on disk
/** @type {PageState["asked"]} */
let asked = "";
let left = 0; // time until the trial may be ended, when that was asked for, in s
/** @type {Shown} */
let shown = "loading";
let loading = 0; // time since which the page has been loading, in ms; 0 if it is loaded
const panel = new Panel(
  byId("panel", HTMLDialogElement),
  {
    run,
    leave: () => connection.send({ type: "leave" }),
    hide: () => ask(""),
    takeover: () => connection.send({ type: "takeover" }),
    reload: () => location.reload(),
  },
  () => canvas.focus(),
);
const choice = draw === "auto" && new URLSearchParams(location.search).get("draw");
const picture = new Picture(choice || draw, {
  send: (message) => connection.send(message),
  flush: (until) => connection.flush(until),
  shown: (step) => hud.reached(step),
  changed: update,
});
const connection = new Connection(() => ({ type: "hello", tab, trial, view: picture.view }), take);
const inputs = new Inputs((values) => {
  const input = connection.input({ ...values, step: picture.drawn?.step ?? null });
  picture.add(input);
  if (!values.press) return;
  pressed = input.number;
  if (picture.drawn) showBusy("one_moment");
});
const sounds = new Sounds();
const bindings = new Bindings();
const hud = new Hud(() => bindings.label("act"));
const help = new Help(byId("help", HTMLDialogElement), bindings, () => {
  ask("");
  canvas.focus();
});
const commands = {
  help: () => (help.open ? help.hide() : openHelp()),
  pause: () => (shown === "paused" ? run() : pause("asked")),
  unknownPad: () => {
    const notice = byId("notice", HTMLElement);
    notice.textContent = textOf("gamepad_unknown");
    notice.showPopover?.();
    setTimeout(() => notice.hidePopover?.(), NOTICE);
  },
  confirm: () => /** @type {HTMLElement | null} */ (document.querySelector("dialog[open] .button"))?.click(),
};
const listens = () => session.phase === "running" && shown === "task" && !help.open;

/** @param {Received} message */
function take(message) {
  picture.take(message);
  switch (message.type) {
    case "state":
      takeState(message);
      break;
    case "pictures":
      hud.learn(message);
      break;
    case "hud":
      hud.show(message.state);
      picture.drawn?.headset?.show(message.state, message.state.clock);
      sounds.hear(message.state);
      break;
    case "moment":
      hud.expect(message);
      break;
    case "snapshot":
      if (message.busy) showBusy("hands_moving");
      else if (message.input >= pressed) showBusy("");
      break;
    case "beat":
      if (session.phase === "running") connection.send({ type: "beat" }); // without a timer, which would be slow in hidden pages
      break;
    case "busy":
      showBusy(message.busy ? "hands_moving" : "");
      break;
    case "saved":
      connection.close();
      saved = true;
      setTimeout(() => location.reload(), DONE);
      break;
    case "queue":
      connection.close();
      location.reload(); // the page shows the queue
      break;
    case "error":
      if (message.code !== "idle") console.warn(`the server refused a message (${message.code}): ${message.message}`);
      break;
    case "closed":
      takeState({ phase: "loading", reason: "" });
  }
  update();
}

/** @param {Pick<State, "phase" | "reason">} state */
function takeState(state) {
  const { phase } = session;
  session.take(state);
  if (state.phase !== "running") {
    stopping = false;
    picture.drawn?.end();
  } else if (phase !== "running") inputs.send(); // the session may have the state of an earlier page
  if (document.hidden && state.phase === "paused") session.wanted = false;
}

/** @returns {PageState} */
const state = () => ({
  phase: session.phase,
  reason: session.reason,
  saved,
  wanted: session.wanted,
  link: connection.link,
  drawing: picture.drawing,
  hidden: document.hidden,
  asked,
});

/** Shows what the state demands, and lets the clock run only if that is the task. */
function update() {
  const now = state();
  if (resumes(now)) return run();
  const next = shownIn(now);
  if (next !== "task" && session.phase === "running") stop(pauseReason(next));
  shown = next;
  if (shown !== "loading") loading = 0;
  else if (!loading) {
    loading = performance.now();
    setTimeout(update, LATE);
  }
  const stopped = session.phase === "running" ? "paused" : session.phase;
  page.dataset.phase = shown === "task" ? "running" : stopped; // the style sheet hides the task while the clock is stopped
  for (const id of ["redraw-button", "server-draws"]) byId(id, HTMLElement).hidden = draw !== "auto" || !picture.fault;
  if (shown === "task" || shown === "help") panel.hide();
  else if (shown === "instructions") panel.show(instructions());
  else panel.show(dialogs.dialogOf(shown, now, left, picture.fault, performance.now() - loading >= LATE));
  if (shown === "failed") connection.close();
  if (shown === "paused" && document.pointerLockElement) document.exitPointerLock();
}

/** @param {string} name of the text that explains why a key has no effect, or empty */
function showBusy(name) {
  const mark = byId("busy", HTMLElement);
  mark.hidden = !name;
  mark.textContent = name && textOf(name);
  mark.classList.toggle("asked", name !== "hands_moving");
}

/** @param {number} now ms */
function drawPicture(now) {
  const drawn = session.phase === "running" ? picture.draw(now) : null;
  if (!drawn) return;
  hud.moveReach(drawn.reach);
  sounds.walk(drawn.body[0] ?? 0, drawn.body[1] ?? 0);
  byId("view", HTMLElement).classList.toggle("moving", drawn.moving);
}

function report() {
  if (session.phase !== "running") return;
  const { kilobits, ...seen } = picture.report();
  const { width, height } = canvas.getBoundingClientRect();
  const size = { width: Math.max(1, Math.round(width)), height: Math.max(1, Math.round(height)) };
  if (seen.renderer && !isStill(seen)) {
    connection.send({ type: "display", ...seen, ...size, pixel_ratio: window.devicePixelRatio || 1 });
  }
  byId("debug", HTMLElement).textContent =
    `${seen.latency_ms ?? "–"} ms · ${seen.frames_per_s} fps · ${kilobits} kbit/s · ${seen.renderer} · ${connection.pending} not taken`;
}

function instructions() {
  const touch = matchMedia("(pointer: coarse)").matches;
  const key = touch ? null : (/** @type {string} */ name) => bindings.key(name);
  return dialogs.instructions(trial, Number(objects), performance.now() >= endable, hud.example, key, hud.roles, hud.markers);
}

function run() {
  asked = "";
  if (!session.run()) return;
  stopping = false;
  picture.drawn?.begin(performance.now());
  picture.meter.take(); // leaves the pause out of the measurements
  sounds.unlock();
  connection.send({ type: "run", until: picture.drawn ? 0 : null }); // the clock waits for our control steps
  inputs.send(); // the server has released all keys during the pause
  update();
}

/** Stops the clock until `update` finds that it may run again. @param {PauseReason} reason */
function stop(reason) {
  if (session.phase !== "running" || stopping) return;
  stopping = true;
  connection.send({ type: "pause", reason });
}

/** Stops the clock until the participant starts it. @param {PauseReason} reason */
function pause(reason) {
  if (session.phase !== "running") return;
  session.wanted = false;
  inputs.release();
  stop(reason);
}

/** Opens a dialog of the participant, or closes it. @param {PageState["asked"]} dialog */
function ask(dialog) {
  asked = dialog;
  if (dialog) inputs.release();
  if (dialog && document.pointerLockElement) document.exitPointerLock();
  update();
}

function askToEnd() {
  if (page.dataset["leave"]) location.assign(page.dataset["leave"]);
  else {
    left = Math.ceil((endable - performance.now()) / 1000);
    ask("ending");
  }
}

function openHelp() {
  ask("help");
  help.show();
}

byId("panel", HTMLDialogElement).addEventListener("keydown", (event) => {
  if (shown !== "paused" || bindings.action(event.code)?.name !== "pause") return;
  event.stopPropagation(); // otherwise the view handles the key and pauses again
  run();
});
byId("help-button", HTMLElement).addEventListener("click", openHelp);
byId("pause-button", HTMLElement).addEventListener("click", () => commands.pause());
byId("redraw-button", HTMLElement).addEventListener("click", () => location.reload());
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
connectKeyboard(bindings, inputs, commands, listens);
const mouse = connectMouse(canvas, inputs, listens);
connectTouch(canvas, byId("touch", HTMLElement), inputs, listens, (x, y) => hud.isReached(x, y));
connectGamepad(inputs, commands, listens);
watchPage(canvas, {
  release: () => inputs.release(),
  hidden: () => pause("hidden"),
  blur: (away) => connection.send({ type: "blur", away }),
  close: () => connection.close(),
  resize: () => picture.resize(),
  resized: () => picture.tellSize(),
});
document.addEventListener("visibilitychange", update);
setInterval(() => connection.watch(session.phase === "running"), 1000 * BEAT_PERIOD);
setInterval(report, 1000 * DISPLAY_PERIOD);
setInterval(() => session.phase === "running" && picture.drawn?.tick(performance.now()), TICK);
byId("debug", HTMLElement).hidden = !new URLSearchParams(location.search).has("debug");
rememberVisit();
update();
learnLayout();
const lack = await picture.prepare();
const { drawn: view } = picture;
view?.world.onFrame(drawPicture);
if (page.dataset["scene"]) view?.prepare(page.dataset["scene"]);
if (view && "headset" in page.dataset) {
  view.headset = new HeadsetPage(view.world, inputs);
  view.headset.offer(byId("headset-button", HTMLElement), () => view.heading);
}
new Settings(byId("settings", HTMLFormElement), ({ sensitivity, inverted, sounds: audible, calm, text, degrees }) => {
  Object.assign(mouse, { sensitivity, inverted });
  sounds.on = audible;
  picture.setFieldOfView(degrees);
  if (picture.drawn) picture.drawn.calm = calm;
  document.documentElement.classList.toggle("calm", calm);
  document.documentElement.style.fontSize = `${100 * text}%`;
});
if (!lack || draw !== "browser") connection.open();
