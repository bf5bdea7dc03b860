// Shows what a participant sees during a trial. This page sends nothing: the server closes a connection that does.

/** @import { FrameMessage, ToBrowser } from "../protocol.js" */

import { readFrame } from "../connection.js";
import { byId } from "../dom.js";
import { DrawnView } from "../drawn_view.js";
import { Hud } from "../hud.js";
import { Screen } from "../screen.js";

const AGAIN = 2000; // delay before reconnecting, in ms
const STATES = { loading: "loading", ready: "reading the instructions", running: "", paused: "paused", over: "the trial is over", failed: "the session has failed" };

const page = byId("play", HTMLElement);
const note = byId("note", HTMLElement);
const [name = ""] = (note.textContent ?? "").split(":");
const hud = new Hud(() => "");
const screen = new Screen(byId("screen", HTMLCanvasElement), (frame) => hud.reached(frame.step), () => say("this browser cannot decode the frames"));
const drawn = world();
let loaded = Promise.resolve(); // resolved once the house is loaded
let state = ""; // the session's state as shown

/** @param {string} text */
function say(text) {
  note.textContent = text ? `${name}: ${text}` : name;
}

/** The view drawn by this browser, or null without WebGL 2. */
function world() {
  try {
    const view = new DrawnView(byId("world", HTMLCanvasElement), () => {});
    view.world.onLost = () => say("this browser stopped drawing. Reload the page");
    return view;
  } catch {
    return null;
  }
}

/** @param {ToBrowser | FrameMessage} message */
function take(message) {
  switch (message.type) {
    case "state":
      page.dataset.phase = message.phase;
      state = STATES[message.phase];
      say(state);
      break;
    case "frame":
      byId("world", HTMLElement).hidden = true;
      screen.show(message);
      break;
    case "scene":
      if (!drawn) return say("this browser cannot draw the apartment");
      byId("world", HTMLElement).hidden = false;
      say("loading the apartment");
      loaded = drawn.load(message).then(() => say(state), () => say("the apartment cannot be loaded"));
      break;
    case "snapshot": // snapshots that arrive while the house loads are handled in order afterwards
      loaded.then(() => drawn?.take(message, performance.now()));
      hud.reached(message.step);
      break;
    case "markers":
      loaded.then(() => drawn?.world.setMarkers(message.markers));
      break;
    case "pictures":
      hud.learn(message);
      break;
    case "hud":
      hud.show(message.state);
      break;
    case "moment":
      hud.expect(message);
      drawn?.outline(message.reach);
  }
}

function open() {
  const socket = new WebSocket(location.href.replace(/^http/, "ws"));
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data }) => take(typeof data === "string" ? JSON.parse(data) : readFrame(data));
  socket.onclose = () => {
    page.dataset.phase = "loading";
    say("not playing on this server. This page reconnects automatically");
    screen.reset();
    setTimeout(open, AGAIN);
  };
}

if (drawn) {
  new ResizeObserver(() => drawn.world.resize()).observe(byId("world", HTMLElement)); // the canvas is hidden before the first scene
  drawn.world.onFrame((now) => {
    const seen = drawn.draw(now);
    if (seen) hud.moveReach(seen.reach);
  });
}
byId("list-title", HTMLElement).textContent = "Not started yet";
open();
