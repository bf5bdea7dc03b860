// The texts of all dialogs.

/** @typedef {{ title: string, texts: string[], buttons?: [string, string][] }} Dialog buttons: label and action */

/** @type {Record<string, string>} */
const PAUSED = {
  asked: "The clock is stopped.",
  hidden: "Paused while the page was hidden.",
  silent: "Paused while there was no connection.",
  disconnected: "Paused while there was no connection.",
  restarted: "Paused while the session was restored.",
  "taken over": "Paused while the session moved to this page.",
};

/** @type {[string, string][]} */
const SKIP = [["Skip the training", "leave"]];

/** @param {boolean} interrupted @returns {Dialog} */
export const loading = (interrupted) => ({
  title: "One moment",
  texts: [interrupted ? "Your session is being restored. Nothing is lost." : "The apartment is being loaded."],
});

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
      title: "Training",
      texts: ["Find one object, pick it up and put it into its bin. There is no time limit.", controls],
      buttons: [["Start the training", "run"], ...(skippable ? SKIP : [])],
    };
  }
  const what = objects === 1 ? "Put the object into its bin" : `Put all ${objects} objects into their bins`;
  return {
    title: "Your task",
    texts: [`${what} as fast as you can. The clock starts when you choose Start.`],
    buttons: [["Start", "run"]],
  };
}

export const TOUCH_CONTROLS =
  "Walk and turn with the buttons at the lower left. Drag across the view to look around. “Pick or place” picks up an object or puts it into its bin. “Help” shows all controls.";

/** @param {(action: string) => string} key names of the keys of an action */
export const keyControls = (key) =>
  `Walk with ${key("forward")}, ${key("left")}, ${key("back")}, ${key("right")}. Turn with the mouse, or with ${key("turnLeft")} and ${key("turnRight")}. ${key("act")} picks up an object or puts it into its bin. ${key("help")} shows all keys.`;

/** @param {string} reason @returns {Dialog} */
export const paused = (reason) => ({
  title: "Paused",
  texts: [PAUSED[reason] ?? ""],
  buttons: [["Continue", "run"]],
});

/** @param {string} trial @param {number} left s until it may be ended @returns {Dialog} */
export const ending = (trial, left) =>
  left > 0
    ? { title: "Not yet", texts: [`You can end the ${trial} in ${left} s.`], buttons: [["Continue", "hide"]] }
    : {
        title: `End the ${trial} now?`,
        texts: ["What you did so far is kept."],
        buttons: [["Continue", "hide"], [`End the ${trial}`, "leave"]],
      };

/** @param {string} reason @param {boolean} saved @returns {Dialog} */
export const over = (reason, saved) => ({
  title: reason === "all delivered" ? "All done" : "This part is over",
  texts: ["The next page opens in a moment."],
  buttons: saved ? [["Continue", "reload"]] : [],
});

/** @param {number} position @returns {Dialog} */
export const queue = (position) => ({
  title: "All places are taken",
  texts: [
    position === 1 ? "You are next." : `You are number ${position} in the queue.`,
    "Please keep this page open. It continues by itself.",
  ],
});

/** @param {string} reason @returns {Dialog} */
export const cannotDraw = (reason) => ({
  title: "This browser cannot draw the apartment",
  texts: [`It needs WebGL 2 (${reason}). Please try another browser, or another computer.`],
});

/** @type {Dialog} */
export const OCCUPIED = {
  title: "This session is open in another page",
  texts: ["Only one page at a time can show it."],
  buttons: [["Continue here", "takeover"]],
};

/** @type {Dialog} */
export const REPLACED = {
  title: "This session continues in another page",
  texts: ["You can close this page."],
  buttons: [["Continue here", "reload"]],
};

/** @type {Dialog} */
export const OFFLINE = {
  title: "No connection",
  texts: ["The clock is paused. This page reconnects by itself. Nothing is lost."],
};

/** @type {Dialog} */
export const CLOSED = {
  title: "The connection was closed",
  texts: ["Your session is kept."],
  buttons: [["Reconnect", "reload"]],
};

/** @type {Dialog} */
export const IDLE = {
  title: "You were away for a long time",
  texts: ["Your session is kept."],
  buttons: [["Continue", "reload"]],
};

/** @param {string} message @returns {Dialog} */
export const failed = (message) => ({
  title: "Something went wrong",
  texts: [message],
  buttons: [["Try again", "reload"]],
});
