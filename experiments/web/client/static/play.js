// The page on which a trial is played: joins view, controls, connection and dialogs.

/** @import { Codec, PauseReason, View } from "./protocol.js" */
/** @import { Received } from "./connection.js" */

import { Bindings } from "./bindings.js";
import { Connection } from "./connection.js";
import { Debug } from "./debug.js";
import * as dialogs from "./dialogs.js";
import { byId } from "./dom.js";
import { connectGamepad } from "./gamepad.js";
import { Help } from "./help.js";
import { Inputs } from "./inputs.js";
import { Keyboard } from "./keyboard.js";
import { Panel } from "./panel.js";
import { connectMouse, connectTouch } from "./pointer.js";
import { TOO_MUCH } from "./protocol.js";
import { Screen, bestCodec } from "./screen.js";
import { Session } from "./session.js";
import { showText } from "./texts.js";
import { rememberVisit } from "./visit.js";

const HIDDEN_GRACE = 5000; // ms that the page may be hidden before the session is paused
const DONE = 1500; // ms for which the end of a trial is shown
const RESIZED = 300; // ms after which a new size of the page is sent

const { trial = "", objects = "" } = byId("play", HTMLElement).dataset;
const canvas = byId("screen", HTMLCanvasElement);
const tab = Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16)).join("-");

const session = new Session();
/** @type {Codec} */
let codec = "jpeg";
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
const debug = new Debug(byId("debug", HTMLElement), new URLSearchParams(location.search).has("debug"));
const screen = new Screen(
  canvas,
  (frame) => {
    connection.send({ type: "seen", frame: frame.number });
    debug.shown(frame, connection.pending);
  },
  () => {
    codec = "jpeg";
    sendView();
  },
);
/** @returns {View} */
const view = () => ({ type: "view", ...screen.size, codec, snapshots: false });
const connection = new Connection(() => ({ type: "hello", tab, trial, view: view() }), take);
const inputs = new Inputs((input) => debug.sent(connection.input(input)));
const bindings = new Bindings();
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
  switch (message.type) {
    case "state":
      session.take(message);
      showState();
      break;
    case "frame":
      screen.show(message);
      if (session.phase === "ready") showInstructions(); // there is something to see now
      break;
    case "text":
      showText(message);
      break;
    case "busy":
      byId("busy", HTMLElement).hidden = !message.busy;
      break;
    case "saved":
      connection.close();
      panel.show(dialogs.over(true));
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
      if (!message.final) {
        session.lose();
        panel.show(dialogs.OFFLINE);
      } else if (message.code === TOO_MUCH) panel.show(dialogs.CLOSED);
  }
}

function showState() {
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
      panel.show(dialogs.over(false));
      break;
    case "failed":
      connection.close();
      panel.show(dialogs.failed(session.reason));
  }
}

function showInstructions() {
  const touch = matchMedia("(pointer: coarse)").matches;
  const controls = touch ? dialogs.TOUCH_CONTROLS : dialogs.keyControls((name) => bindings.label(name));
  const dialog = dialogs.instructions(trial, Number(objects), controls);
  if (panel.title !== dialog.title) panel.show(dialog);
}

function run() {
  if (!session.run()) return;
  panel.hide();
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
  panel.show(dialogs.ending(trial));
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
connectMouse(canvas, inputs, listens);
connectTouch(canvas, byId("touch", HTMLElement), inputs, listens);
connectGamepad(inputs, commands, listens);
watchPage();
rememberVisit();
panel.show(dialogs.loading(false));
codec = await bestCodec();
connection.open();
