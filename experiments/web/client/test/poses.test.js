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

describe("poses of objects", () => {
  test("converting a pose to the body frame and back does not change it", () => {
    const body = [0.4, -1.2, 2.5];
    const pose = [1, 2, 0.5, Math.SQRT1_2, 0, Math.SQRT1_2, 0];
    near(toHouse(toBody(pose, body), body), pose);
    near(toBody(pose, [1, 2, 0]), [0, 0, 0.5, ...pose.slice(3)]);
  });

  test("quaternions of opposite sign are treated as the same orientation", () => {
    near(mixed([0, 0, 0, 1, 0, 0, 0], [2, 0, 0, -1, 0, 0, 0], 0.5), [1, 0, 0, 1, 0, 0, 0]);
  });

  test("poses are interpolated between two states", () => {
    const poses = new Poses();
    poses.take(state({ objects: { cup: POSE } }), 0, REST);
    near(poses.at("cup", 0, REST), POSE);
    poses.take(state({ objects: { cup: AHEAD } }), 1, REST);
    near(poses.at("cup", 1.025, REST), [1.02, 2, 0.5, 1, 0, 0, 0]);
    near(poses.at("cup", 9, REST), AHEAD);
  });

  test("a held object follows the drawn body instead of the server's body", () => {
    const poses = new Poses();
    poses.take(state({ objects: { cup: POSE }, held: ["cup", null] }), 0, REST);
    near(poses.at("cup", 1, [3, 0, 0]), [4, 2, 0.5, 1, 0, 0, 0]);
    near(poses.at("cup", 1, [0, 0, Math.PI / 2])?.slice(0, 3), [-2, 1, 0.5]);
  });

  test("a released object starts from the pose at which it was drawn", () => {
    const poses = new Poses();
    poses.take(state({ objects: { cup: POSE }, held: ["cup", null] }), 0, REST);
    const drawn = [0.2, 0, 0]; // the drawn body is ahead of the server
    const before = poses.at("cup", 1, drawn);
    poses.take(state({ objects: { cup: POSE } }), 1, drawn);
    near(poses.at("cup", 1, drawn), before ?? []);
    near(poses.at("cup", 2, drawn), POSE);
  });

  test("the pose of an object that must no longer be visible is deleted", () => {
    const poses = new Poses();
    poses.take(state({ objects: { cup: POSE } }), 0, REST);
    poses.take(state({ gone: ["cup"] }), 1, REST);
    expect(poses.at("cup", 1, REST)).toBeUndefined();
  });
});
