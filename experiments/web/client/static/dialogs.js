// The contents of all dialogs.

/** @import { PageState, Shown } from "./page_state.js" */

import { textOf } from "./texts.js";

/**
 * @typedef {object} Dialog
 * @property {string} title
 * @property {string[]} texts
 * @property {[string, string][]} [pictures] address and label
 * @property {{ address: string, legend: string[] }} [markers] a picture of the markers, and a line for each kind
 * @property {[string[], string][]} [keys] names of keys, and their effect
 * @property {[string, string][]} [buttons] label and action
 */

/**
 * A dialog of a title, a text and buttons.
 * @param {string} title
 * @param {string} content
 * @param {[string, string][]} [buttons] names of the labels' texts, and actions
 * @param {Record<string, string | number>} [values] in the text
 * @returns {Dialog}
 */
const dialog = (title, content, buttons = [], values = {}) => ({
  title: textOf(title),
  texts: [textOf(content, values)],
  buttons: buttons.map(([label, action]) => [textOf(label), action]),
});

/** Roles of markers that the instructions explain. The rims of breadcrumbs belong to these. */
const EXPLAINED = ["breadcrumb", "flagpole", "goal"];

/**
 * @param {string} trial
 * @param {number} objects
 * @param {boolean} skippable
 * @param {[string, string][]} pictures addresses and labels of an object and its bin
 * @param {((action: string) => string) | null} key name of an action's key; null for touch screens
 * @param {string[]} [roles] of the markers in a picture
 * @param {string} [address] of the picture of the markers
 * @returns {Dialog}
 */
export function instructions(trial, objects, skippable, pictures, key, roles = [], address = "") {
  const legend = EXPLAINED.filter((role) => roles.includes(role)).map((role) => textOf(`marker_${role}`));
  const task = objects === 1 ? textOf("task_one") : textOf("task_many", { count: objects });
  const shown = trial === "training" ? textOf("training_text") : `${task} ${textOf("clock_starts")}`;
  return {
    title: textOf(trial),
    texts: key ? [shown] : [shown, textOf("touch_text")],
    pictures,
    ...(legend.length ? { markers: { address, legend } } : {}),
    keys: key ? keysOf(key) : [],
    buttons: trial === "training" ? [[textOf("start_training"), "run"], ...(skippable ? skip() : [])] : [[textOf("start"), "run"]],
  };
}

/** @returns {[string, string][]} */
const skip = () => [[textOf("skip_training"), "leave"]];

/** @param {(action: string) => string} key name of an action's key @returns {[string[], string][]} */
const keysOf = (key) => [
  [["forward", "left", "back", "right"].map(key), textOf("keys_walk")],
  [["turnLeft", "turnRight"].map(key), textOf("keys_turn")],
  [[key("act")], textOf("action_act")],
  [[key("help")], textOf("keys_help")],
];

/**
 * Returns the dialog of a page that shows neither the task nor its help or instructions.
 * @param {Exclude<Shown, "task" | "help" | "instructions">} shown
 * @param {PageState} state
 * @param {number} left time until the trial may be ended, in s
 * @param {string} fault reason why this browser does not draw
 * @param {boolean} late true if the page has been loading for long
 */
export function dialogOf(shown, { wanted, reason, saved }, left, fault, late) {
  switch (shown) {
    case "loading":
      if (late) return dialog("one_moment", "loading_late", [["try_again", "reload"]]);
      return dialog("one_moment", wanted ? "restoring" : "loading");
    case "ending":
      if (left > 0) return dialog("end_later", "end_later_text", [["next", "hide"]], { seconds: left });
      return dialog("end_now", "end_now_text", [["next", "hide"], ["end_part", "leave"]]);
    case "paused":
      return dialog("paused", `paused_${reason.replace(" ", "_")}`, [["next", "run"]]);
    case "over":
      return dialog(reason === "all delivered" ? "all_done" : "part_over", "next_page", saved ? [["next", "reload"]] : []);
    case "undrawable":
      return dialog("cannot_draw", "cannot_draw_text", [["try_again", "reload"]], { reason: fault });
    default:
      return dialog(...OTHERS[shown]);
  }
}

/** @type {Record<"occupied" | "replaced" | "redrawing" | "offline" | "closed" | "idle" | "failed", Parameters<typeof dialog>>} */
const OTHERS = {
  occupied: ["occupied", "occupied_text", [["continue_here", "takeover"]]],
  replaced: ["replaced", "replaced_text", [["continue_here", "reload"]]],
  redrawing: ["one_moment", "redrawing_text"],
  offline: ["offline", "offline_text"],
  closed: ["closed", "session_kept", [["reconnect", "reload"]]],
  idle: ["idle", "session_kept", [["next", "reload"]]],
  failed: ["failed", "failed_text", [["try_again", "reload"]]],
};
