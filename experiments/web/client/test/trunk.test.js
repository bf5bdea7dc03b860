import { describe, expect, test } from "vitest";

import { HEADING, VX, VY, X, Y } from "../static/prediction/body.js";
import { Trunk } from "../static/prediction/trunk.js";
import { IDLE, Walker } from "../static/prediction/walking.js";
import { GAIT } from "./walks.js";

/** Returns a floor with one grid cell and boxes as obstacles. @param {[number, number, number, number][]} boxes xMin, xMax, yMin, yMax, m */
function floor(...boxes) {
  return {
    edges: boxes.flatMap(([a, b, c, d]) => [a, c, 1, 0, b - a, b, c, 0, 1, d - c, b, d, -1, 0, b - a, a, d, 0, -1, d - c]),
    first: [0, ...boxes.map((_, i) => 4 * (i + 1))], boxes: boxes.flat(), near: boxes.map((_, i) => i), near_first: [0, boxes.length],
    origin_x: -5, origin_y: -5, rows: 1, columns: 1, cell: 10, margin: 0.12,
  };
}

/** Walks for a number of control steps. @param {ReturnType<typeof floor>} where @param {number} heading @param {number} steps */
function walked(where, heading, steps) {
  const walker = new Walker(GAIT, where);
  const body = new Float64Array(16);
  body[HEADING] = heading;
  let nearest = Infinity; // smallest distance to a wall, in metres
  for (let k = 0; k < steps; k++) {
    walker.step(body, { ...IDLE, forward: 1.3 });
    for (const [a, b, c, d] of Array.from({ length: where.boxes.length / 4 }, (_, i) => where.boxes.slice(4 * i, 4 * i + 4))) {
      const [x = 0, y = 0] = [body[X], body[Y]];
      const [dx, dy] = [Math.max((a ?? 0) - x, 0, x - (b ?? 0)), Math.max((c ?? 0) - y, 0, y - (d ?? 0))];
      nearest = Math.min(nearest, Math.hypot(dx, dy));
    }
  }
  return { body, nearest };
}

describe("predicted walk", () => {
  test("the person stops at a wall", () => {
    const { body, nearest } = walked(floor([1, 2, -3, 3]), 0, 60);
    expect(body[X]).toBeCloseTo(1 - GAIT.radius, 6);
    expect(nearest).toBeGreaterThan(GAIT.radius - 1e-6);
  });

  test("the person slides along a wall that is hit at an angle, and around its corner", () => {
    const along = walked(floor([1, 2, -3, 3]), Math.PI / 4, 60);
    expect(along.body[X]).toBeCloseTo(1 - GAIT.radius, 6);
    expect(along.body[Y]).toBeGreaterThan(1.5);
    const around = walked(floor([1, 2, -3, 0.1]), 0.3, 80);
    expect(around.body[X]).toBeGreaterThan(2);
    expect(around.nearest).toBeGreaterThan(GAIT.radius - 1e-6);
  });

  test("the person stops in a corner and in front of a narrow gap", () => {
    const corner = walked(floor([1, 2, -3, 3], [-3, 1, 0.5, 2]), Math.PI / 4, 100);
    expect([corner.body[X], corner.body[Y]]).toEqual([expect.closeTo(1 - GAIT.radius), expect.closeTo(0.5 - GAIT.radius)]);
    const gap = walked(floor([1, 2, 0.15, 3], [1, 2, -3, -0.15]), 0, 100);
    expect(gap.body[X]).toBeLessThan(1);
    expect(gap.nearest).toBeGreaterThan(GAIT.radius - 1e-6);
  });
});

test("a body inside an obstacle is pushed out in the shortest direction", () => {
  const body = new Float64Array(16);
  [body[X], body[Y], body[VX]] = [1.1, 0, 1];
  new Trunk(floor([1, 2, -3, 3]), 0.2).slide(body, 0.004);
  expect([body[X], body[VX], body[VY]]).toEqual([expect.closeTo(0.8), 0, 0]);
});

test("a body that is wedged between two walls does not move", () => {
  const body = new Float64Array(16);
  [body[X], body[Y], body[VX]] = [1.5, 0, 1];
  new Trunk(floor([1, 2, 0.1, 3], [1, 2, -3, -0.1]), 0.2).slide(body, 0.004);
  expect([body[X], body[Y], body[VX]]).toEqual([1.5, 0, 0]);
});
