import { describe, expect, test } from "vitest";

import { Session } from "../static/session.js";

/** @import { Phase } from "../static/protocol.js" */

const PHASES = /** @type {Phase[]} */ (["loading", "ready", "running", "paused", "over", "failed"]);

/** @param {[Phase, string?][]} states */
function after(...states) {
  const session = new Session();
  for (const [phase, reason = ""] of states) session.take({ phase, reason });
  return session;
}

describe("the copy of the state", () => {
  test.each(PHASES)("is %s when the server sends it", (phase) => {
    expect(after([phase, "why"])).toMatchObject({ phase, reason: "why" });
  });

  test.each(PHASES)("runs ahead of the server only where the clock can be started: %s", (phase) => {
    const session = after([phase]);
    const runs = phase === "ready" || phase === "paused";
    expect(session.run()).toBe(runs);
    expect(session.phase).toBe(runs ? "running" : phase);
  });
});

test("a session is wanted from the start of its clock, whatever the server sends", () => {
  const session = after(["ready"]);
  expect(session.wanted).toBe(false);
  session.run();
  session.take({ phase: "paused", reason: "restarted" });
  expect(session.wanted).toBe(true);
});
