import { describe, expect, test } from "vitest";

import { resumes, shownIn } from "../static/page_state.js";

/** @import { PageState } from "../static/page_state.js" */

/** @type {{ [Name in keyof PageState]: PageState[Name][] }} */
const VALUES = {
  phase: ["loading", "ready", "running", "paused", "over", "failed"],
  reason: [""],
  saved: [false, true],
  wanted: [false, true],
  link: ["opening", "open", "lost", "occupied", "replaced", "idle", "closed"],
  drawing: ["loading", "ready", "lost", "failed"],
  hidden: [false, true],
  asked: ["", "help", "ending"],
};

/** Every combination of the values. */
const STATES = Object.entries(VALUES).reduce(
  (states, [name, values]) => states.flatMap((state) => values.map((value) => ({ ...state, [name]: value }))),
  /** @type {any[]} */ ([{}]),
);
/** @type {PageState} */
const RUNNING = { phase: "running", reason: "", saved: false, wanted: true, link: "open", drawing: "ready", hidden: false, asked: "" };

describe("in every state of the page", () => {
  test("the task is shown only with a link and a picture, and without a dialog", () => {
    for (const state of STATES) {
      if (shownIn(state) !== "task") continue;
      expect(state).toMatchObject({ link: "open", drawing: "ready", asked: "", saved: false });
      expect(state.phase === "running" || resumes(state)).toBe(true);
    }
  });

  test("the clock starts again only where the participant would see the task", () => {
    for (const state of STATES) {
      if (resumes(state)) expect([shownIn(state), state.wanted, state.hidden]).toEqual(["task", true, false]);
    }
  });

  test("a link that is closed for good is shown, unless the session is over", () => {
    for (const state of STATES) {
      if (!["occupied", "replaced", "idle", "closed"].includes(state.link) || state.saved || state.phase === "failed") continue;
      expect(shownIn(state)).toBe(state.link);
    }
  });
});

test.each(/** @type {[Partial<PageState>, string][]} */ ([
  [{}, "task"],
  [{ asked: "help" }, "help"],
  [{ asked: "ending", phase: "paused" }, "ending"],
  [{ asked: "help", phase: "ready" }, "instructions"],
  [{ phase: "paused" }, "task"],
  [{ phase: "paused", hidden: true }, "paused"],
  [{ phase: "paused", wanted: false }, "paused"],
  [{ phase: "loading" }, "loading"],
  [{ phase: "loading", link: "lost" }, "offline"],
  [{ drawing: "lost" }, "redrawing"],
  [{ drawing: "failed", link: "lost" }, "undrawable"],
  [{ drawing: "loading" }, "loading"],
  [{ phase: "over" }, "over"],
  [{ phase: "over", link: "closed", saved: true }, "over"],
  [{ phase: "failed", link: "lost" }, "failed"],
]))("%o shows %s", (change, shown) => {
  expect(shownIn({ ...RUNNING, ...change })).toBe(shown);
});
