// Shows what a person sees, while they play. Nothing is sent: a server closes the connection of who says anything.

/** @import { Frame, ToBrowser } from "../protocol.js" */

import { readFrame } from "../connection.js";
import { byId } from "../dom.js";
import { DrawnView } from "../drawn_view.js";
import { Hud } from "../hud.js";
import { Screen } from "../screen.js";

const AGAIN = 2000; // ms until the next attempt
const STATES = { loading: "loading", ready: "reads the instructions", running: "", paused: "paused", over: "the trial is over", failed: "the session has failed" };

const page = byId("play", HTMLElement);
const note = byId("note", HTMLElement);
const [name = ""] = (note.textContent ?? "").split(":");
const hud = new Hud(() => "");
const screen = new Screen(byId("screen", HTMLCanvasElement), (frame) => hud.reached(frame.step), () => say("this browser cannot decode the frames"));
const drawn = world();
let loaded = Promise.resolve(); // once the house is there
let state = ""; // of the session, in words

/** @param {string} text */
function say(text) {
  note.textContent = text ? `${name}: ${text}` : name;
}

/** The view that this browser draws, if it can. */
function world() {
  try {
    return new DrawnView(byId("world", HTMLCanvasElement), () => {}, () => say("this browser has stopped drawing: reload the page"));
  } catch {
    return null;
  }
}

/** @param {ToBrowser | Frame} message */
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
      if (!drawn) return say("this browser cannot draw what the person's browser draws");
      byId("world", HTMLElement).hidden = false;
      say("the house is being loaded");
      loaded = drawn.load(message).then(() => say(state), () => say("the house cannot be loaded"));
      break;
    case "snapshot": // those that come while the house is loaded are taken in order after that
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
    say("is not playing on this server now; this page looks again by itself");
    screen.reset();
    setTimeout(open, AGAIN);
  };
}

if (drawn) {
  new ResizeObserver(() => drawn.world.resize()).observe(byId("world", HTMLElement)); // it is hidden until it is drawn
  drawn.world.onFrame((now) => {
    const seen = drawn.draw(now);
    if (seen) hud.moveReach(seen.reach);
  });
}
byId("list-title", HTMLElement).textContent = "Not begun yet";
open();
