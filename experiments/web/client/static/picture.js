// The picture of the apartment, drawn by this browser or as frames from the server.

/** @import { Codec, Draw, Input, SceneMessage, View } from "./protocol.js" */
/** @import { Received } from "./connection.js" */
/** @import { Drawn } from "./drawn_view.js" */

import { byId } from "./dom.js";
import { DrawnView } from "./drawn_view.js";
import { Meter } from "./meter.js";
import { Screen, bestCodec } from "./screen.js";

const DEGREE = Math.PI / 180; // rad
const SLOWEST = 20; // frame rate below which the server draws instead, in fps

/**
 * @typedef {object} Events
 * @property {(message: View | Draw | { type: "seen", frame: number }) => void} send
 * @property {(until: number) => void} flush sends the inputs of control steps before `until`
 * @property {(step: number) => void} shown the state of this control step is shown
 * @property {() => void} loaded the first picture is ready
 * @property {(reason: string) => void} failed this browser cannot draw, and the server must not
 */

export class Picture {
  meter = new Meter();
  /** @type {DrawnView | null} */
  drawn = null; // null if the server draws
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
      this.drawn = new DrawnView(byId("world", HTMLCanvasElement), this.#events.flush, () => this.fallBack("context lost"));
      this.drawn.world.resize();
      return null;
    } catch (error) {
      this.#show(false);
      const reason = error instanceof Error ? error.message : `${error}`;
      if (this.#wanted === "browser") this.#events.failed(reason);
      return reason;
    }
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
        this.#events.loaded();
        break;
      case "scene":
        this.#offer(message);
        drawn?.load(message).then(this.#events.loaded, (error) => this.fallBack(`house not loaded: ${error.message}`));
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

  /** Returns the display quality since the last call. A browser that is too slow stops drawing. */
  report() {
    const seen = this.meter.take();
    const slow = seen.frames_per_s < SLOWEST && !document.hidden;
    const draw = /** @type {"browser" | "server"} */ (this.drawn ? "browser" : "server");
    const { renderer } = this;
    const field = this.#chosen === null ? {} : { field_of_view: this.#chosen };
    if (slow && this.drawn && this.#wanted === "auto") this.fallBack("slow");
    return { draw, renderer, ...field, ...seen };
  }

  /** Lets the server draw from now on. @param {string} reason */
  fallBack(reason) {
    if (!this.drawn) return;
    if (this.#wanted === "browser") return this.#events.failed(reason);
    this.drawn = this.#chosen = null;
    byId("field-of-view", HTMLElement).hidden = true;
    this.#show(false);
    this.#events.send({ type: "draw", draw: "server", reason });
    this.#sendView();
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
