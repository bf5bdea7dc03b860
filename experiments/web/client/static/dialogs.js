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
 * A dialog of a title, a text and at most one button.
 * @param {string} title @param {string} content @param {string} [label] of the button @param {string} [action]
 * @returns {Dialog}
 */
const dialog = (title, content, label, action) => ({
  title: textOf(title),
  texts: [textOf(content)],
  buttons: label && action ? [[textOf(label), action]] : [],
});

/** @param {boolean} interrupted @param {boolean} [late] true if the page has been loading for long */
export const loading = (interrupted, late) =>
  late ? dialog("one_moment", "loading_late", "try_again", "reload") : dialog("one_moment", interrupted ? "restoring" : "loading");

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

/** @param {string} reason */
export const paused = (reason) => dialog("paused", `paused_${reason.replace(" ", "_")}`, "next", "run");

/** @param {number} left s until it may be ended @returns {Dialog} */
export const ending = (left) =>
  left > 0
    ? {
        title: textOf("end_later"),
        texts: [textOf("end_later_text", { seconds: left })],
        buttons: [[textOf("next"), "hide"]],
      }
    : {
        title: textOf("end_now"),
        texts: [textOf("end_now_text")],
        buttons: [[textOf("next"), "hide"], [textOf("end_part"), "leave"]],
      };

/** @param {string} reason @param {boolean} saved @returns {Dialog} */
export const over = (reason, saved) => ({
  title: textOf(reason === "all delivered" ? "all_done" : "part_over"),
  texts: [textOf("next_page")],
  buttons: saved ? [[textOf("next"), "reload"]] : [],
});

/** @param {string} reason @returns {Dialog} */
const cannotDraw = (reason) => ({
  title: textOf("cannot_draw"),
  texts: [textOf("cannot_draw_text", { reason })],
  buttons: [[textOf("try_again"), "reload"]],
});

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
      return loading(wanted, late);
    case "ending":
      return ending(left);
    case "paused":
      return paused(reason);
    case "over":
      return over(reason, saved);
    case "undrawable":
      return cannotDraw(fault);
    default:
      return dialog(...OTHERS[shown]);
  }
}

/** @type {Record<"occupied" | "replaced" | "redrawing" | "offline" | "closed" | "idle" | "failed", Parameters<typeof dialog>>} */
const OTHERS = {
  occupied: ["occupied", "occupied_text", "continue_here", "takeover"],
  replaced: ["replaced", "replaced_text", "continue_here", "reload"],
  redrawing: ["one_moment", "redrawing_text"],
  offline: ["offline", "offline_text"],
  closed: ["closed", "session_kept", "reconnect", "reload"],
  idle: ["idle", "session_kept", "next", "reload"],
  failed: ["failed", "failed_text", "try_again", "reload"],
};
