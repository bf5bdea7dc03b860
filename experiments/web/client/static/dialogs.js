// The contents of all dialogs.

import { textOf } from "./texts.js";

/** @typedef {{ title: string, texts: string[], buttons?: [string, string][] }} Dialog buttons: label and action */

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

/** @param {boolean} interrupted */
export const loading = (interrupted) => dialog("one_moment", interrupted ? "restoring" : "loading");

/**
 * @param {string} trial
 * @param {number} objects
 * @param {string} controls
 * @param {boolean} skippable
 * @returns {Dialog}
 */
export function instructions(trial, objects, controls, skippable) {
  if (trial === "training") {
    return {
      title: textOf("training"),
      texts: [textOf("training_text"), controls],
      buttons: [[textOf("start_training"), "run"], ...(skippable ? skip() : [])],
    };
  }
  const task = objects === 1 ? textOf("task_one") : textOf("task_many", { count: objects });
  return {
    title: textOf("task"),
    texts: [`${task} ${textOf("clock_starts")}`],
    buttons: [[textOf("start"), "run"]],
  };
}

/** @returns {[string, string][]} */
const skip = () => [[textOf("skip_training"), "leave"]];

/** @param {(action: string) => string} key names of the keys of an action */
export function keyControls(key) {
  const names = ["forward", "left", "back", "right", "turnLeft", "turnRight", "act", "help"];
  return textOf("keys_text", Object.fromEntries(names.map((name) => [name, key(name)])));
}

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
export const cannotDraw = (reason) => ({
  title: textOf("cannot_draw"),
  texts: [textOf("cannot_draw_text", { reason })],
});

export const occupied = () => dialog("occupied", "occupied_text", "continue_here", "takeover");
export const replaced = () => dialog("replaced", "replaced_text", "continue_here", "reload");
export const offline = () => dialog("offline", "offline_text");
export const closed = () => dialog("closed", "session_kept", "reconnect", "reload");
export const idle = () => dialog("idle", "session_kept", "next", "reload");
export const failed = () => dialog("failed", "failed_text", "try_again", "reload");
