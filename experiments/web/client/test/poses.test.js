import { describe, expect, test } from "vitest";

import { Poses, mixed, toBody, toHouse } from "../static/prediction/poses.js";

const REST = [0, 0, 0];
const POSE = [1, 2, 0.5, 1, 0, 0, 0];
const AHEAD = [1.04, 2, 0.5, 1, 0, 0, 0];

/** @import { Snapshot } from "../static/protocol.js" */

/** @param {Partial<Snapshot>} more @returns {Pick<Snapshot, "objects" | "gone" | "held" | "body">} */
const state = (more) => ({ objects: {}, gone: [], held: [null, null], body: REST, ...more });

/** @param {number[] | undefined} pose @param {number[]} expected */
const near = (pose, expected) => expected.forEach((value, i) => expect(pose?.[i]).toBeCloseTo(value, 9));

describe("poses", () => {
  test("lead through the frame of the body and back", () => {
    const body = [0.4, -1.2, 2.5];
    const pose = [1, 2, 0.5, Math.SQRT1_2, 0, Math.SQRT1_2, 0];
    near(toHouse(toBody(pose, body), body), pose);
    near(toBody(pose, [1, 2, 0]), [0, 0, 0.5, ...pose.slice(3)]);
  });

  test("of the same orientation with another sign are the same", () => {
    near(mixed([0, 0, 0, 1, 0, 0, 0], [2, 0, 0, -1, 0, 0, 0], 0.5), [1, 0, 0, 1, 0, 0, 0]);
  });

  test("glide from one state to the next", () => {
    const poses = new Poses();
    poses.take(state({ objects: { cup: POSE } }), 0, REST);
    near(poses.at("cup", 0, REST), POSE);
    poses.take(state({ objects: { cup: AHEAD } }), 1, REST);
    near(poses.at("cup", 1.025, REST), [1.02, 2, 0.5, 1, 0, 0, 0]);
    near(poses.at("cup", 9, REST), AHEAD);
  });

  test("in a hand follow the body that is drawn, not the one of the state", () => {
    const poses = new Poses();
    poses.take(state({ objects: { cup: POSE }, held: ["cup", null] }), 0, REST);
    near(poses.at("cup", 1, [3, 0, 0]), [4, 2, 0.5, 1, 0, 0, 0]);
    near(poses.at("cup", 1, [0, 0, Math.PI / 2])?.slice(0, 3), [-2, 1, 0.5]);
  });

  test("leave the hand where they are drawn", () => {
    const poses = new Poses();
    poses.take(state({ objects: { cup: POSE }, held: ["cup", null] }), 0, REST);
    const drawn = [0.2, 0, 0]; // ahead of the server
    const before = poses.at("cup", 1, drawn);
    poses.take(state({ objects: { cup: POSE } }), 1, drawn);
    near(poses.at("cup", 1, drawn), before ?? []);
    near(poses.at("cup", 2, drawn), POSE);
  });

  test("of an object that may not be known any more are forgotten", () => {
    const poses = new Poses();
    poses.take(state({ objects: { cup: POSE } }), 0, REST);
    poses.take(state({ gone: ["cup"] }), 1, REST);
    expect(poses.at("cup", 1, REST)).toBeUndefined();
  });
});
