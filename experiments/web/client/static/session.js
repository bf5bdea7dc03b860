// A copy of the session's state, which the worker owns.

/** @import { Phase, State } from "./protocol.js" */

import { TRANSITIONS } from "./protocol.js";

export class Session {
  /** @type {Phase} */
  phase = "loading";
  reason = "";
  interrupted = false; // true if the clock was running when the connection or worker was lost

  /** @param {Pick<State, "phase" | "reason">} state from the server */
  take({ phase, reason }) {
    if (phase === "loading" || reason === "silent") this.interrupted ||= this.phase === "running";
    else if (reason !== "disconnected" && reason !== "restarted") this.interrupted = false;
    this.phase = phase;
    this.reason = reason;
  }

  /** Records that the connection is lost. The state is unknown until the server sends it. */
  lose() {
    this.take({ phase: "loading", reason: "" });
  }

  /** Starts the clock before the server confirms it. Returns false if that is not possible. */
  run() {
    const after = TRANSITIONS[this.phase]["run"];
    if (!after) return false;
    this.take({ phase: after, reason: "" });
    return true;
  }
}
