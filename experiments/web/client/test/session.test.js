import { describe, expect, test } from "vitest";

import { TRANSITIONS } from "../static/protocol.js";
import { Session } from "../static/session.js";

/** @import { Phase } from "../static/protocol.js" */

const PHASES = /** @type {Phase[]} */ (Object.keys(TRANSITIONS));

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

  test.each(PHASES)("runs ahead of the server only where the table allows it: %s", (phase) => {
    const session = after([phase]);
    const runs = phase === "ready" || phase === "paused";
    expect(session.run()).toBe(runs);
    expect(session.phase).toBe(runs ? "running" : phase);
  });

  test("every phase that follows another one is a phase", () => {
    for (const triggers of Object.values(TRANSITIONS)) {
      for (const phase of Object.values(triggers)) expect(PHASES).toContain(phase);
    }
  });
});

describe("a session whose clock ran is interrupted", () => {
  test("when the connection is lost", () => {
    const session = after(["ready"], ["running"]);
    session.lose();
    session.lose();
    expect(session).toMatchObject({ phase: "loading", interrupted: true });
    session.take({ phase: "paused", reason: "disconnected" });
    expect(session.interrupted).toBe(true);
    session.run();
    expect(session).toMatchObject({ phase: "running", interrupted: false });
  });

  test("when the server heard nothing of this page", () => {
    expect(after(["running"], ["paused", "silent"]).interrupted).toBe(true);
  });

  test("when its worker is restored", () => {
    expect(after(["running"], ["loading"], ["paused", "restarted"]).interrupted).toBe(true);
  });

  test.each(["asked", "hidden", "taken over"])("but not if it was paused: %s", (reason) => {
    expect(after(["running"], ["paused", reason], ["loading"], ["paused", "disconnected"]).interrupted).toBe(false);
  });

  test("but not on a page that was loaded again", () => {
    expect(after(["loading"], ["paused", "disconnected"]).interrupted).toBe(false);
  });
});
