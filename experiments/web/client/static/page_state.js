// What the page of a trial shows, as a function of everything that it knows.

/** @import { PauseReason, Phase } from "./protocol.js" */

/**
 * @typedef {"opening" | "open" | "lost" | "occupied" | "replaced" | "idle" | "closed"} Link
 * @typedef {"loading" | "ready" | "lost" | "failed"} Drawing
 * @typedef {object} PageState
 * @property {Phase} phase of the session, as last sent by the server
 * @property {string} reason of a pause or an end
 * @property {boolean} saved true once the run is complete on disk
 * @property {boolean} wanted true if the participant wants the clock to run
 * @property {Link} link state of the connection
 * @property {Drawing} drawing state of the picture
 * @property {boolean} hidden true if the tab is hidden
 * @property {"" | "help" | "ending"} asked dialog that the participant has opened
 */

/** @typedef {"task" | "loading" | "instructions" | "help" | "ending" | "paused" | "over" | "failed" | "offline" | "redrawing" | "undrawable" | "occupied" | "replaced" | "idle" | "closed"} Shown */

/** @type {Set<Link>} links that do not reconnect automatically */
const CLOSED = new Set(["occupied", "replaced", "idle", "closed"]);

/**
 * Returns what the page shows. Only `task` lets the clock run.
 * @param {PageState} state
 * @returns {Shown}
 */
export function shownIn(state) {
  const { phase, link, drawing, asked } = state;
  if (phase === "failed") return "failed";
  if (state.saved) return "over";
  if (CLOSED.has(link)) return /** @type {Shown} */ (link);
  if (drawing === "failed") return "undrawable";
  if (link === "lost") return "offline";
  if (phase === "over") return "over";
  if (link === "opening" || phase === "loading") return "loading";
  if (drawing === "lost") return "redrawing";
  if (drawing === "loading") return "loading";
  if (asked && phase !== "ready") return asked;
  if (phase === "ready") return "instructions";
  return phase === "running" || resumes(state) ? "task" : "paused";
}

/** Returns why the clock is stopped when something other than the task is shown. @param {Shown} shown @returns {PauseReason} */
export function pauseReason(shown) {
  if (shown === "offline") return "silent";
  return shown === "redrawing" || shown === "undrawable" || shown === "loading" ? "picture lost" : "asked";
}

/**
 * Returns true if the clock must be started again, because something other than the participant has stopped it.
 * @param {PageState} state
 */
export function resumes({ phase, saved, wanted, link, drawing, hidden, asked }) {
  return phase === "paused" && !saved && wanted && link === "open" && drawing === "ready" && !hidden && !asked;
}
