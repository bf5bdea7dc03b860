// The picture of the apartment, drawn by this browser or as frames from the server.

/** @import { Drawing } from "./page_state.js" */
/** @import { Codec, Draw, Input, SceneMessage, View } from "./protocol.js" */
/** @import { Received } from "./connection.js" */
/** @import { Drawn } from "./drawn_view.js" */

import { byId } from "./dom.js";
import { DrawnView } from "./drawn_view.js";
import { Meter } from "./meter.js";
import { Screen, bestCodec } from "./screen.js";

const DEGREE = Math.PI / 180; // rad
export const SLOWEST = 20; // frame rate below which the picture becomes coarser, or the server draws, in fps
const JUDGED_AFTER = 2; // duration of measurements that may change how the picture is drawn, in s
export const COARSER = 0.7; // factor of the resolution of a slow picture
const COARSEST = 0.5; // lowest resolution before the server draws, as a share of the display's
const MAX_RATIO = 2; // most drawn pixels per CSS pixel in each direction
const RESTORED_WITHIN = 5000; // how long a lost context may take to return, in ms

/** Returns the resolution to draw with, as a share of the display's. @param {number} scale that share without `MAX_RATIO` */
export const resolution = (scale) => scale * Math.min(1, MAX_RATIO / (window.devicePixelRatio || 1));

/**
 * @typedef {object} Events
 * @property {(message: View | Draw | { type: "seen", frame: number }) => void} send
 * @property {(until: number) => void} flush sends the inputs of control steps before `until`
 * @property {(step: number) => void} shown the state of this control step is shown
 * @property {() => void} changed `drawing` has changed
 */

export class Picture {
  meter = new Meter();
  /** @type {DrawnView | null} */
  drawn = null; // null if the server draws
  /** @type {Drawing} */
  drawing = "loading";
  fault = ""; // reason why this browser does not draw
  #wanted;
  #events;
  #screen;
  #told = { width: 0, height: 0 }; // px
  /** @type {Codec} */
  #codec = "jpeg";
  #degrees = 0; // field of view chosen by the person; 0 for the default
  /** @type {number | null} */
  #chosen = null; // field of view in radians; null if it cannot be chosen
  #frame = ""; // description of the last frame
  #scale = 1; // resolution as a share of the display's
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #lost; // timer while the context is lost

  /** @param {string} wanted `auto`, `browser` or `server` @param {Events} events */
  constructor(wanted, events) {
    this.#wanted = wanted;
    this.#events = events;
    this.#screen = new Screen(
      byId("screen", HTMLCanvasElement),
      (frame) => {
        events.send({ type: "seen", frame: frame.number });
        this.meter.shown(frame);
        this.#frame = `frames of the server, ${frame.codec}, ${frame.width}x${frame.height}`;
        events.shown(frame.step);
      },
      () => {
        this.#codec = "jpeg";
        this.#sendView();
      },
    );
  }

  /** Checks this browser. Returns the reason why it does not draw, or null. @returns {Promise<string | null>} */
  async prepare() {
    this.#codec = await bestCodec();
    if (this.#wanted === "server") return null;
    try {
      this.#show(true);
      this.drawn = new DrawnView(byId("world", HTMLCanvasElement), this.#events.flush);
      const { world } = this.drawn;
      world.onLost = () => this.#lose();
      world.onRestored = () => this.#restore();
      this.resize();
      return null;
    } catch (error) {
      this.#show(false);
      this.fault = error instanceof Error ? error.message : `${error}`;
      if (this.#wanted === "browser") this.#change("failed");
      return this.fault;
    }
  }

  /** @param {Drawing} drawing */
  #change(drawing) {
    this.drawing = drawing;
    this.#events.changed();
  }

  #lose() {
    if (!this.drawn) return;
    this.#change("lost");
    this.#lost = setTimeout(() => this.fallBack("context lost"), RESTORED_WITHIN);
  }

  #restore() {
    if (!this.drawn || this.drawing !== "lost") return;
    clearTimeout(this.#lost);
    this.#change("ready");
  }

  /** Adapts the drawing to the size of the view. */
  resize() {
    this.drawn?.world.resize(resolution(this.#scale));
  }

  /** Returns the view to request from the server. @returns {View} */
  get view() {
    this.#told = this.#screen.size;
    return { type: "view", ...this.#told, codec: this.drawn ? "none" : this.#codec, ...(this.#degrees && { field_of_view: this.#degrees * DEGREE }) };
  }

  /** Name of the renderer; empty before the first picture. */
  get renderer() {
    return this.drawn ? this.drawn.world.info().renderer : this.#frame;
  }

  /** @param {Received} message */
  take(message) {
    const { drawn, meter } = this;
    switch (message.type) {
      case "frame":
        meter.came(message);
        this.#screen.show(message);
        if (this.drawing === "loading" && !this.drawn) this.#change("ready");
        break;
      case "scene":
        this.#offer(message);
        drawn?.load(message).then(
          () => this.drawing === "loading" && this.#change("ready"),
          (error) => this.fallBack(`house not loaded: ${error.message}`),
        );
        break;
      case "snapshot":
        drawn?.take(message, performance.now());
        meter.answered(message.input);
        this.#events.shown(message.step);
        break;
      case "markers":
        drawn?.world.setMarkers(message.markers);
        break;
      case "moment":
        drawn?.outline(message.reach);
        break;
      case "closed":
        this.#screen.reset();
    }
  }

  /** @param {number} now ms @returns {Drawn | null} null where the server draws */
  draw(now) {
    this.drawn?.tick(now);
    const drawn = this.drawn?.draw(now) ?? null;
    if (drawn) this.meter.drawn();
    return drawn;
  }

  /** @param {Input} input */
  add(input) {
    this.drawn?.add(input);
    this.meter.sent(input.number);
  }

  /** Returns the display quality since the last call or the start of the clock. A browser that is too slow draws less. */
  report() {
    const { seconds, ...seen } = this.meter.take();
    if (!this.drawn && seen.frame_ms) seen.frames_per_s = 1000 / seen.frame_ms; // the server sends no unchanged frames
    const slow = this.drawn && seen.frames_per_s < SLOWEST && seconds > JUDGED_AFTER && !document.hidden;
    const draw = /** @type {"browser" | "server"} */ (this.drawn ? "browser" : "server");
    const { renderer } = this;
    const field = this.#chosen === null ? {} : { field_of_view: this.#chosen };
    if (slow && this.drawing === "ready" && this.#wanted === "auto") this.#lighten();
    return { draw, renderer, ...field, ...seen };
  }

  /** Draws with a lower resolution, or, if that is the lowest one already, lets the server draw. */
  #lighten() {
    if (this.#scale * COARSER >= COARSEST) {
      this.#scale *= COARSER;
      this.resize();
      this.#events.send({ type: "draw", draw: "browser", reason: `slow: ${Math.round(100 * this.#scale)} % of the resolution` });
    } else this.fallBack("slow");
  }

  /** Lets the server draw until the page is loaded again. @param {string} reason */
  fallBack(reason) {
    if (!this.drawn) return;
    clearTimeout(this.#lost);
    this.fault = reason;
    if (this.#wanted === "browser") return this.#change("failed");
    this.drawn = this.#chosen = null;
    byId("field-of-view", HTMLElement).hidden = true;
    this.#show(false);
    this.#events.send({ type: "draw", draw: "server", reason });
    this.#sendView();
    this.#change("loading");
  }

  /** Requests another field of view. The next scene confirms it. @param {number} degrees 0 for the default */
  setFieldOfView(degrees) {
    if (degrees === this.#degrees) return;
    this.#degrees = degrees;
    if (this.drawn) this.#sendView();
  }

  /** Shows the choice of the field of view if the study allows it. @param {SceneMessage} message */
  #offer({ field_of_view_range: range, field_of_view: angle }) {
    this.#chosen = range && this.drawn && angle;
    const row = byId("field-of-view", HTMLElement);
    row.hidden = this.#chosen === null;
    const [input, output] = [row.querySelector("input"), row.querySelector("output")];
    if (!range || !input || !output) return;
    [input.min, input.max] = [`${Math.ceil(range[0] / DEGREE)}`, `${Math.floor(range[1] / DEGREE)}`];
    input.value = `${Math.round(angle / DEGREE)}`;
    output.value = `${input.value}°`;
  }

  /** Sends the size to the server if it has changed. */
  tellSize() {
    const { width, height } = this.#screen.size;
    if (width !== this.#told.width || height !== this.#told.height) this.#sendView();
  }

  #sendView() {
    this.#screen.reset();
    this.#events.send(this.view);
  }

  /** @param {boolean} drawn whether this browser draws */
  #show(drawn) {
    byId("world", HTMLCanvasElement).hidden = !drawn;
    byId("play", HTMLElement).classList.toggle("fills", drawn);
  }
}
