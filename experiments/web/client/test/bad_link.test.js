// Tests of walking over a slow link that loses packets: the drawn view must move as smoothly as without a link.

import { describe, expect, test, vi } from "vitest";

import { DrawnView } from "../static/drawn_view.js";
import { HEADING, X, Y } from "../static/prediction/body.js";
import { Predictor } from "../static/prediction/predictor.js";
import { Walker } from "../static/prediction/walking.js";
import { DT, EMPTY, GAIT, SPEEDS } from "./walks.js";

/** @import { Input, SceneMessage, Snapshot } from "../static/protocol.js" */

vi.mock("../static/drawing/world.js", () => ({
  World3D: class {
    load = async () => ({ objects: {} });
    camera = { setEye() {}, locate() {} };
    loadModels() {}
    setFieldOfView() {}
    setObjects() {}
    setPerson() {}
    draw() {}
  },
}));

const FRAME = 1000 / 60; // duration of a frame in ms
const PATIENCE = 750; // how long the server waits for inputs, in ms
const RESENT = 250; // time until a lost packet is sent again, in ms
const [EARTHLY, TURNING] = [GAIT.max_speed * 0.001 * FRAME, GAIT.max_turn * 0.001 * FRAME]; // largest change per frame in m and rad

/** One direction of a network connection. Packets arrive in order, but some are late. */
class Way {
  /** @type {{ at: number, message: any }[]} */
  #flying = [];
  #last = 0;
  #random;
  #delay;
  #lost;

  /** @param {number} delay ms @param {number} lost share @param {() => number} random */
  constructor(delay, lost, random) {
    this.#delay = delay;
    this.#lost = lost;
    this.#random = random;
  }

  /** @param {any} message @param {number} now ms */
  send(message, now) {
    const resent = this.#random() < this.#lost ? RESENT : 0;
    this.#last = Math.max(this.#last, now + this.#delay * (0.9 + 0.2 * this.#random()) + resent);
    this.#flying.push({ at: this.#last, message });
  }

  /** @param {number} now ms */
  *arrived(now) {
    while (this.#flying[0] && this.#flying[0].at <= now) yield this.#flying.shift()?.message;
  }
}

/** A server that takes control steps when their inputs have arrived, or without the inputs after a timeout. */
class Server {
  forced = 0;
  #due = Infinity;
  #until = 0;
  /** @type {Input[]} */
  #inputs = [];
  #input = 0;
  #truth = new Predictor(new Walker(GAIT, EMPTY), SPEEDS, DT, 0, new Float64Array(16));

  /** @param {{ run?: boolean, inputs?: Input[], until?: number }} message @param {number} now ms */
  take({ run, inputs = [], until = 0 }, now) {
    if (run) this.#due = now;
    this.#inputs.push(...inputs);
    this.#until = Math.max(this.#until, until);
  }

  /** @param {number} now ms @returns {Snapshot | null} */
  step(now) {
    const step = this.#truth.step;
    const promised = this.#until > step;
    if (now < this.#due || (!promised && now < this.#due + PATIENCE)) return null;
    if (!promised) this.forced++;
    for (const input of this.#inputs.filter((some) => (some.step ?? 0) <= step)) {
      this.#truth.add(input);
      this.#input = input.number;
    }
    this.#inputs = this.#inputs.filter((some) => (some.step ?? 0) > step);
    this.#truth.advance();
    this.#due += 1000 * DT;
    return this.snapshot();
  }

  /** @returns {Snapshot} */
  snapshot() {
    return {
      type: "snapshot", step: this.#truth.step, input: this.#input, time: 0, busy: false, body: [...this.#truth.body], eye: [],
      hands: [[0, 0, 0], [0, 0, 0]], held: [null, null], objects: {}, models: {}, gone: [],
    };
  }
}

/** Plays for 60 s and returns measurements of how the drawn view moved. @param {number} delay ms @param {number} lost */
async function played(delay, lost) {
  vi.stubGlobal("fetch", async () => new Response(JSON.stringify(EMPTY)));
  let seed = 1;
  const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
  const [up, down, server] = [new Way(delay, lost, random), new Way(delay, lost, random), new Server()];
  /** @type {Input[]} */
  const unsent = [];
  let now = 0;
  const view = new DrawnView(
    /** @type {HTMLCanvasElement} */ ({}),
    (until) => up.send({ inputs: unsent.splice(0), until }, now),
  );
  const scene = { path: "/", floor: "/floor", gait: GAIT, speeds: SPEEDS, field_of_view: 1.5, field_of_view_range: null, step_duration: DT };
  await view.load(/** @type {SceneMessage} */ ({ type: "scene", ...scene }));
  view.begin(0);
  up.send({ run: true }, 0);
  let [number, jump, turn, moved] = [0, 0, 0, 0];
  /** @type {number[] | null} */
  let last = null;
  for (; now < 60_000; now += FRAME) {
    for (const message of up.arrived(now)) {
      server.take(message, now);
      if (message.run) down.send(server.snapshot(), now);
    }
    for (let state = server.step(now); state; state = server.step(now)) down.send(state, now);
    for (const state of down.arrived(now)) view.take(state, now);
    if (random() < 0.05 && view.step !== null) {
      const input = { number: ++number, forward: Math.sign(random() - 0.3), turn: random() < 0.3 ? 2 * random() - 1 : 0, step: view.step };
      view.add(input);
      unsent.push(input);
    }
    view.tick(now);
    const drawn = view.draw(now);
    if (!drawn) continue;
    const at = [X, Y, HEADING].map((i) => drawn.body[i] ?? NaN);
    if (last) {
      jump = Math.max(jump, Math.hypot((at[0] ?? 0) - (last[0] ?? 0), (at[1] ?? 0) - (last[1] ?? 0)));
      turn = Math.max(turn, Math.abs((at[2] ?? 0) - (last[2] ?? 0)));
      moved += Math.hypot((at[0] ?? 0) - (last[0] ?? 0), (at[1] ?? 0) - (last[1] ?? 0));
    }
    last = at;
  }
  return { jump, turn, moved, forced: server.forced };
}

describe("the drawn view on a bad link", () => {
  test.each([
    ["a good link", 5, 0],
    ["a link with a round trip of 200 ms and 2 % packet loss", 100, 0.02],
    ["a link with a round trip of 400 ms and 5 % packet loss", 200, 0.05],
  ])("the view moves without jumps over %s", async (_, delay, lost) => {
    const { jump, turn, moved } = await played(delay, lost);
    expect(moved).toBeGreaterThan(20); // metres
    expect(jump).toBeLessThan(1.5 * EARTHLY);
    expect(turn).toBeLessThan(1.5 * TURNING);
  });

  test("the server never has to take a step without inputs at 200 ms and 2 % packet loss", async () => {
    expect((await played(100, 0.02)).forced).toBe(0);
  });
});
