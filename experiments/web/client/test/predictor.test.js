import { beforeEach, describe, expect, test } from "vitest";

import { HEADING, PITCH, X, Y } from "../static/prediction/body.js";
import { Predictor } from "../static/prediction/predictor.js";
import { Walker } from "../static/prediction/walking.js";
import { DT, EMPTY, GAIT, SPEEDS } from "./walks.js";

/** @import { Input } from "../static/protocol.js" */

const predictor = () => new Predictor(new Walker(GAIT, EMPTY), SPEEDS, DT, 0, new Float64Array(16));

/** @param {number} number @param {Partial<Input>} values @returns {Input} */
const input = (number, values) => ({ number, ...values });

/** Measures the largest change of the drawn pose between two frames at 60 fps, in m and rad. */
class Eye {
  /** @type {number[] | null} */
  #last = null;
  jump = 0;

  /** @param {Predictor} seen @param {number} share */
  look(seen, share) {
    const body = seen.drawn(share);
    const now = [X, Y, HEADING, PITCH].map((i) => body[i] ?? NaN);
    const last = this.#last;
    if (last) this.jump = Math.max(this.jump, ...now.map((value, i) => Math.abs(value - (last[i] ?? NaN))));
    this.#last = now;
  }
}

/** @type {Predictor} */
let mine;
/** @type {Predictor} */
let server; // the same predictor, which receives each input at its step
beforeEach(() => {
  mine = predictor();
  server = predictor();
});

/** Advances the prediction and the server by a control step with these inputs. @param {Input[]} inputs */
function both(...inputs) {
  for (const one of [mine, server]) {
    for (const some of inputs) one.add(some);
    one.advance();
  }
}
const state = () => server.body;

describe("prediction", () => {
  test("an input is visible in the next frame before the server responds", () => {
    mine.add(input(1, { forward: 1, turn: 1 }));
    const seen = mine.drawn(0.4);
    expect(seen[X]).toBeGreaterThan(0);
    expect(seen[HEADING]).toBeGreaterThan(0);
  });

  test("states that agree with the prediction do not change it, even if they are late", () => {
    /** @type {Float64Array[]} */
    const states = [];
    for (let k = 0; k < 60; k++) {
      states.push(state());
      both(...(k % 7 ? [] : [input(k + 1, { forward: 1, yaw: 0.3 * Math.sin(k) })]));
      const before = mine.drawn(0.5).slice();
      const late = states[k - 12]; // half a second late
      if (late) mine.correct(k - 12, late, false);
      expect(mine.drawn(0.5)).toEqual(before);
    }
    expect(mine.body).toEqual(server.body);
  });

  test("the view turns by the movement of the mouse and then stops", () => {
    both(input(1, { yaw: 1.2, pitch: -0.4 }));
    for (let k = 0; k < 60; k++) both();
    expect(mine.drawn(0)[HEADING]).toBeCloseTo(1.2, 2);
    expect(mine.drawn(0)[PITCH]).toBeCloseTo(-0.4, 2);
  });

  test("the drawn pose is continuous across control steps without new inputs", () => {
    both(input(1, { forward: 1, turn: 0.5 }));
    const eye = new Eye();
    for (let k = 0; k < 40; k++) {
      for (const share of [0, 0.4, 0.8]) eye.look(mine, share);
      both();
    }
    expect(eye.jump).toBeLessThan(1.4 / 50); // metres per frame at the highest walking speed
  });
});

describe("correction of the prediction", () => {
  /** Walks while the server applies an input 3 steps late and reports this 10 steps later. @returns {Eye} */
  function disagreement() {
    const walk = input(1, { forward: 1 });
    mine.add(walk);
    /** @type {Float64Array[]} */
    const states = [];
    const eye = new Eye();
    for (let k = 0; k < 60; k++) {
      states.push(state());
      if (k === 3) server.add(walk);
      mine.advance();
      server.advance();
      const late = states[k - 10];
      for (const share of [0, 0.4, 0.8]) {
        if (share === 0.4 && late) mine.correct(k - 10, late, false);
        eye.look(mine, share);
      }
    }
    return eye;
  }

  test("the prediction converges to the server's state", () => {
    disagreement();
    expect(mine.drawn(0)[X]).toBeCloseTo(server.drawn(0)[X] ?? NaN, 3);
  });

  test("a small correction does not make the view jump", () => {
    expect(disagreement().jump).toBeLessThan(0.05); // metres per frame for a correction of 0.15 m
  });

  test("a large correction is shown immediately", () => {
    const elsewhere = new Float64Array(16);
    elsewhere[X] = 3;
    mine.correct(0, elsewhere, false);
    expect(mine.drawn(0)[X]).toBe(3);
  });

  test("the prediction continues from the server's state if the server is ahead", () => {
    for (let k = 0; k < 30; k++) server.advance();
    mine.correct(30, state(), false);
    expect(mine.step).toBe(30);
    mine.add(input(1, { forward: 1 }));
    mine.advance();
    expect(mine.step).toBe(31);
  });
});

test("without a prediction, the view follows the server's walk without jumps", () => {
  mine = new Predictor(null, SPEEDS, DT, 0, new Float64Array(16));
  const eye = new Eye();
  server.add(input(1, { forward: 1 }));
  for (let k = 0; k < 50; k++) {
    mine.correct(k, state(), false);
    for (const share of [0, 0.4, 0.8]) eye.look(mine, share);
    mine.advance();
    server.advance();
  }
  expect(eye.jump).toBeLessThan(0.06);
  expect(mine.drawn(0)[X]).toBeCloseTo(server.drawn(0)[X] ?? NaN, 0);
});

describe("prediction during a pick or place", () => {
  test("the prediction stops until the server has finished the pick or place", () => {
    both(input(1, { forward: 1 }));
    const start = state();
    mine.correct(1, start, true);
    expect(mine.predicting).toBe(false);
    mine.advance();
    expect(mine.drawn(1)[X]).toBeCloseTo(start[X] ?? NaN, 2);
    mine.correct(2, start, false);
    expect(mine.predicting).toBe(true);
    for (let k = 0; k < 50; k++) mine.advance();
    expect(mine.drawn(0)[X]).toBeGreaterThan(1); // held inputs still apply
  });

  test("the person stands still in the step in which a pick is requested", () => {
    both(input(1, { forward: 1 }));
    const walking = mine.drawn(1).slice();
    mine.add(input(2, { forward: 1, press: "act" }));
    expect(mine.drawn(1)[X]).toBeLessThan((walking[X] ?? 0) + 1e-3);
  });
});
