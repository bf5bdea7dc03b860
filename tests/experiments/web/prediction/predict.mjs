// Reads cases from standard input, one JSON object, and writes the states of the browser's kernel.

import { readFileSync } from "node:fs";

const source = new URL("../../../../experiments/web/client/static/prediction/", import.meta.url);
const { Walker } = await import(new URL("walking.js", source));
const { Predictor } = await import(new URL("predictor.js", source));

const { gait, speeds, cases } = JSON.parse(readFileSync(0, "utf8"));

/** States after each move. */
function walked({ floor, body, moves }) {
  const walker = new Walker(gait, floor);
  const state = Float64Array.from(body);
  return moves.map(([forward, left, turn, look]) => {
    walker.step(state, { forward, left, turn, look });
    return [...state];
  });
}

/** States after each control step with its inputs. */
function played({ floor, body, inputs }) {
  const predictor = new Predictor(new Walker(gait, floor), speeds, gait.dt, 0, body);
  return inputs.map((some) => {
    for (const input of some) predictor.add(input);
    predictor.advance();
    return [...predictor.drawn(0)];
  });
}

const results = cases.map((one) => (one.moves ? walked(one) : played(one)));
process.stdout.write(JSON.stringify(results));
