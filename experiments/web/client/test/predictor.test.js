import { beforeEach, describe, expect, test } from "vitest";

import { HEADING, PITCH, X, Y } from "../static/prediction/body.js";
import { Predictor } from "../static/prediction/predictor.js";
import { Walker } from "../static/prediction/walking.js";
import { DT, EMPTY, GAIT, SPEEDS } from "./walks.js";

/** @import { Input } from "../static/protocol.js" */

const predictor = () => new Predictor(new Walker(GAIT, EMPTY), SPEEDS, DT, 0, new Float64Array(16));

/** @param {number} number @param {Partial<Input>} values @returns {Input} */
const input = (number, values) => ({ number, ...values });

/** The largest step in what is drawn, in m and rad, between two pictures of 60 a second. */
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
let server; // the same kernel, to which inputs come at their steps
beforeEach(() => {
  mine = predictor();
  server = predictor();
});

/** Both take a control step with these inputs. @param {Input[]} inputs */
function both(...inputs) {
  for (const one of [mine, server]) {
    for (const some of inputs) one.add(some);
    one.advance();
  }
}
const state = () => server.body;

describe("a prediction", () => {
  test("shows an input before any answer, in the next picture", () => {
    mine.add(input(1, { forward: 1, turn: 1 }));
    const seen = mine.drawn(0.4);
    expect(seen[X]).toBeGreaterThan(0);
    expect(seen[HEADING]).toBeGreaterThan(0);
  });

  test("is not touched by states that agree, however late they come", () => {
    /** @type {Float64Array[]} */
    const states = [];
    for (let k = 0; k < 60; k++) {
      states.push(state());
      both(...(k % 7 ? [] : [input(k + 1, { forward: 1, yaw: 0.3 * Math.sin(k) })]));
      const before = mine.drawn(0.5).slice();
      const late = states[k - 12]; // half a second
      if (late) mine.correct(k - 12, late, false);
      expect(mine.drawn(0.5)).toEqual(before);
    }
    expect(mine.body).toEqual(server.body);
  });

  test("follows the mouse to where it points, and stops there", () => {
    both(input(1, { yaw: 1.2, pitch: -0.4 }));
    for (let k = 0; k < 60; k++) both();
    expect(mine.drawn(0)[HEADING]).toBeCloseTo(1.2, 2);
    expect(mine.drawn(0)[PITCH]).toBeCloseTo(-0.4, 2);
  });

  test("is continuous over control steps, when nothing is pressed", () => {
    both(input(1, { forward: 1, turn: 0.5 }));
    const eye = new Eye();
    for (let k = 0; k < 40; k++) {
      for (const share of [0, 0.4, 0.8]) eye.look(mine, share);
      both();
    }
    expect(eye.jump).toBeLessThan(1.4 / 50); // the fastest walk, m a picture
  });
});

describe("a correction", () => {
  /** Walks, and learns 10 steps later that an input has counted 3 steps late. @returns {Eye} */
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

  test("leads to what the server says", () => {
    disagreement();
    expect(mine.drawn(0)[X]).toBeCloseTo(server.drawn(0)[X] ?? NaN, 3);
  });

  test("is not seen as a jump", () => {
    expect(disagreement().jump).toBeLessThan(0.05); // m in a picture, of 0.15 m to correct
  });

  test("of more than a step is shown at once", () => {
    const elsewhere = new Float64Array(16);
    elsewhere[X] = 3;
    mine.correct(0, elsewhere, false);
    expect(mine.drawn(0)[X]).toBe(3);
  });

  test("by a server that is ahead continues from its state", () => {
    for (let k = 0; k < 30; k++) server.advance();
    mine.correct(30, state(), false);
    expect(mine.step).toBe(30);
    mine.add(input(1, { forward: 1 }));
    mine.advance();
    expect(mine.step).toBe(31);
  });
});

test("a walk that is physics is shown as the server says, without jumps", () => {
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

describe("a pick or place", () => {
  test("stops the prediction until the server has finished it", () => {
    both(input(1, { forward: 1 }));
    const start = state();
    mine.correct(1, start, true);
    expect(mine.predicting).toBe(false);
    mine.advance();
    expect(mine.drawn(1)[X]).toBeCloseTo(start[X] ?? NaN, 2);
    mine.correct(2, start, false);
    expect(mine.predicting).toBe(true);
    for (let k = 0; k < 50; k++) mine.advance();
    expect(mine.drawn(0)[X]).toBeGreaterThan(1); // what was held down still counts
  });

  test("that was pressed lets the person stand for that step", () => {
    both(input(1, { forward: 1 }));
    const walking = mine.drawn(1).slice();
    mine.add(input(2, { forward: 1, press: "act" }));
    expect(mine.drawn(1)[X]).toBeLessThan((walking[X] ?? 0) + 1e-3);
  });
});
