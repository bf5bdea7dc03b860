// The page on which a trial is played: joins view, controls, connection and dialogs.

import { ACTIONS, Bindings } from "./bindings.js";
import { Connection } from "./connection.js";
import { Debug } from "./debug.js";
import { connectGamepad } from "./gamepad.js";
import { Help } from "./help.js";
import { Inputs } from "./inputs.js";
import { Keyboard } from "./keyboard.js";
import { Panel } from "./panel.js";
import { connectMouse, connectTouch } from "./pointer.js";
import { Screen, bestCodec } from "./screen.js";
import { showText } from "./texts.js";
import { rememberVisit } from "./visit.js";

const GRACE = 5000; // ms that the page may be hidden before the clock stands
const DONE = 1500; // ms for which the end of a trial is shown
const RESIZED = 300; // ms after which a new size of the page is told

const byId = (id) => document.getElementById(id);
const main = byId("play");
const canvas = byId("screen");
const { phase } = main.dataset;
const tab = Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16)).join("-");

const state = { begun: false, waits: false, paused: null, over: false, codec: "jpeg" };
const panel = new Panel(byId("panel"), () => canvas.focus());
const debug = new Debug(byId("debug"), new URLSearchParams(location.search).has("debug"));
const screen = new Screen(
  canvas,
  (frame) => {
    connection.send({ type: "seen", frame: frame.number });
    debug.shown(frame, connection.pending);
  },
  () => {
    state.codec = "jpeg";
    tellView();
  },
);
const view = () => ({ type: "view", ...screen.size, codec: state.codec, state: false });
const connection = new Connection(() => ({ type: "hello", tab, phase, view: view() }), take);
const inputs = new Inputs((input) => debug.sent(connection.input(input)));
const bindings = new Bindings();
const help = new Help(byId("help"), bindings, () => canvas.focus());
const commands = {
  help: () => (help.open ? help.hide() : openHelp()),
  pause: () => (state.paused ? resume() : pause("asked")),
  confirm: () => document.querySelector("dialog[open] .button")?.click(),
};
const listens = () => state.begun && !state.paused && !state.over && !panel.open && !help.open;
const keyboard = new Keyboard(bindings, inputs, commands, listens);

function take(message) {
  const handler = handlers[message.type];
  if (handler) handler(message);
}

const handlers = {
  ready({ begun }) {
    state.begun = begun;
    state.waits = !begun; // nobody starts the clock before there is something to see
    if (!begun) return;
    inputs.repeat();
    if (!state.paused) panel.hide();
  },
  frame(frame) {
    screen.show(frame);
    if (!state.waits) return;
    state.waits = false;
    showInstructions();
  },
  text: showText,
  busy({ busy }) {
    byId("busy").hidden = !busy;
  },
  paused({ reason }) {
    if (state.over) return;
    state.paused = reason;
    if (reason === "disconnected" && state.goesOn) resume();
    else if (reason) showPaused(reason);
    else panel.hide();
  },
  over() {
    state.over = true;
    connection.close();
    panel.show("Done", ["The next page opens in a moment."], [["Go on", () => location.reload()]]);
    setTimeout(() => location.reload(), DONE);
  },
  queue({ position }) {
    const turn = position === 1 ? "You are next." : `You are number ${position} in the queue.`;
    panel.show("All places are taken", [turn, "Please leave this page open: it goes on by itself."]);
  },
  occupied() {
    panel.show(
      "This session is open elsewhere",
      ["Another page shows it at the moment."],
      [["Go on here", () => connection.send({ type: "takeover" })]],
    );
  },
  replaced() {
    panel.show("This session goes on in another page", ["You can close this one."], [["Go on here", () => location.reload()]]);
  },
  recovering() {
    panel.show("One moment", ["Your session is being prepared. Nothing is lost."]);
  },
  failed({ message }) {
    state.over = true;
    connection.close();
    panel.show("Something went wrong", [message], [["Try again", () => location.reload()]]);
  },
  error(error) {
    if (error.code === "idle") panel.show("Nothing was heard of you for long", ["Your session is kept."], [["Go on", () => location.reload()]]);
    else console.warn(`the server refused a message (${error.code}): ${error.message}`);
  },
  closed({ code, final }) {
    screen.reset();
    if (state.over) return;
    if (!final) {
      state.goesOn = state.begun && (!state.paused || state.goesOn) && !document.hidden;
      panel.show("No connection", ["The page connects again by itself. Nothing is lost."]);
    } else if (code === 4003) {
      panel.show("The connection was closed", ["Your session is kept."], [["Connect again", () => location.reload()]]);
    }
  },
};

function showInstructions() {
  const training = phase === "training";
  const title = training ? "Training" : "Your task";
  const count = Number(main.dataset.objects);
  const texts = training
    ? ["Find one object, pick it up and put it into its bin. Take all the time you like.", keysText()]
    : [`Put ${count === 1 ? "the object" : `all ${count} objects`} into ${count === 1 ? "its bin" : "their bins"}, in as little time as you can. The clock starts now.`];
  const actions = [[training ? "Start the training" : "Start", begin]];
  if (training) actions.push(["Skip it", leave]);
  panel.show(title, texts, actions);
}

function keysText() {
  if (matchMedia("(pointer: coarse)").matches) {
    return "Walk and turn with the buttons at the lower left; drag over the view to look around. Pick or place picks up and puts into the bin. Help shows all controls.";
  }
  const key = (name) => bindings.label(ACTIONS.find((action) => action.name === name));
  return `Walk with ${key("forward")}, ${key("left")}, ${key("back")}, ${key("right")}; turn with the mouse, or with ${key("turnLeft")} and ${key("turnRight")}. ${key("act")} picks up and puts into the bin. ${key("help")} shows all keys.`;
}

function begin() {
  state.begun = true;
  panel.hide();
  connection.send({ type: "begin" });
  connection.resend();
}

function leave() {
  connection.send({ type: "leave" });
}

function pause(reason) {
  if (!state.begun || state.over) return;
  release();
  connection.send({ type: "pause", reason });
}

function resume() {
  state.goesOn = false;
  state.paused = null;
  panel.hide();
  connection.send({ type: "resume" });
}

function showPaused(reason) {
  if (document.pointerLockElement) document.exitPointerLock();
  const text = reason === "asked" ? "The clock stands." : "The clock stood while this page was away.";
  panel.show("Paused", [text], [["Go on", resume]]);
}

function askToEnd() {
  release();
  const what = phase === "training" ? "the training" : "the task";
  panel.show(`End ${what} now?`, ["What you did until now is kept."], [
    ["Go on", () => panel.hide()],
    [`End ${what}`, leave],
  ]);
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

function tellView() {
  screen.reset();
  connection.send(view());
}

function watchPage() {
  let hidden = null;
  document.addEventListener("visibilitychange", () => {
    clearTimeout(hidden);
    if (!document.hidden) return;
    release();
    hidden = setTimeout(() => pause("hidden"), GRACE);
  });
  window.addEventListener("blur", () => {
    release();
    connection.send({ type: "blur", away: true });
  });
  window.addEventListener("focus", () => connection.send({ type: "blur", away: false }));
  window.addEventListener("pagehide", () => connection.close());
  let resized = null;
  window.addEventListener("resize", () => {
    clearTimeout(resized);
    resized = setTimeout(tellView, RESIZED);
  });
}

byId("panel").addEventListener("keydown", (event) => {
  if (!state.paused || bindings.action(event.code)?.name !== "pause") return;
  event.stopPropagation(); // else the view, which listens again, pauses anew
  resume();
});
byId("help-button").addEventListener("click", openHelp);
byId("pause-button").addEventListener("click", () => commands.pause());
byId("end-button").addEventListener("click", askToEnd);
connectMouse(canvas, inputs, listens);
connectTouch(canvas, byId("touch"), ACTIONS, inputs, listens);
connectGamepad(ACTIONS, inputs, commands, listens);
watchPage();
rememberVisit();
panel.show("One moment", ["The apartment is being prepared."]);
state.codec = await bestCodec();
connection.open();
