// A copy of the state of the session, which the worker owns.

/** @import { Phase, State } from "./protocol.js" */

import { TRANSITIONS } from "./protocol.js";

export class Session {
  /** @type {Phase} */
  phase = "loading";
  reason = "";
  interrupted = false; // whether the clock ran when the connection or the worker was lost

  /** @param {Pick<State, "phase" | "reason">} state from the server */
  take({ phase, reason }) {
    if (phase === "loading" || reason === "silent") this.interrupted ||= this.phase === "running";
    else if (reason !== "disconnected" && reason !== "restarted") this.interrupted = false;
    this.phase = phase;
    this.reason = reason;
  }

  /** The connection is lost: the state is not known until the server sends it. */
  lose() {
    this.take({ phase: "loading", reason: "" });
  }

  /** Let the clock run, ahead of the answer of the server; false where it cannot. */
  run() {
    const after = TRANSITIONS[this.phase]["run"];
    if (!after) return false;
    this.take({ phase: after, reason: "" });
    return true;
  }
}
