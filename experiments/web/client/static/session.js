// A copy of the session's state, which the worker owns.

/** @import { Phase, State } from "./protocol.js" */

import { STARTABLE } from "./protocol.js";

export class Session {
  /** @type {Phase} */
  phase = "loading";
  reason = "";
  wanted = false; // true if the participant wants the clock to run

  /** @param {Pick<State, "phase" | "reason">} state from the server */
  take({ phase, reason }) {
    this.phase = phase;
    this.reason = reason;
  }

  /** Starts the clock before the server confirms it. Returns false if that is not possible. */
  run() {
    this.wanted = true;
    if (!STARTABLE.includes(this.phase)) return false;
    this.take({ phase: "running", reason: "" });
    return true;
  }
}
