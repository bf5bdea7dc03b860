// Experimental: the HUD as a picture, for a panel in a headset.

/** @import { HudState } from "../protocol.js" */

import { textOf } from "../texts.js";

const ROWS = 6; // of the task list, from one before the current on
const LINE = 48; // px
const COLOURS = { ground: "#0d1118", text: "#f2f2f2", faint: "#9aa3b2", current: "#f0e442" };

/**
 * @param {HTMLCanvasElement} canvas 1024 x 512 px
 * @param {HudState} hud
 * @param {string} clock
 */
export function drawPanel(canvas, hud, clock) {
  const context = canvas.getContext("2d");
  if (!context) return;
  let y = 0;
  const line = (/** @type {string} */ text, /** @type {string} */ colour, bold = false) => {
    context.font = `${bold ? "bold " : ""}40px sans-serif`;
    context.fillStyle = colour;
    context.fillText(text, 24, (y += LINE), canvas.width - 48);
  };
  context.fillStyle = COLOURS.ground;
  context.fillRect(0, 0, canvas.width, canvas.height);
  line([textOf("progress", { count: hud.delivered, all: hud.total }), clock, hud.message?.text].filter(Boolean).join("  |  "), COLOURS.text);
  line(hud.checklist_title, COLOURS.text, true);
  const current = hud.checklist.findIndex((item) => item.current);
  const first = Math.max(0, Math.min(current - 1, hud.checklist.length - ROWS) + hud.scroll);
  for (const item of hud.checklist.slice(first, first + ROWS)) {
    const mark = item.carried ? `${textOf("in_hand")}: ` : item.done ? `${textOf("item_done")}: ` : item.number === null ? "" : `${item.number}. `;
    line(`${mark}${item.text}   ${item.detail.replace("\n", " ")}`, item.current ? COLOURS.current : item.done ? COLOURS.faint : COLOURS.text);
  }
  const [left, right] = hud.inventory.map((slot) => slot?.label ?? textOf("empty"));
  line(hud.inventory[0] ? `${textOf("left_hand")}: ${left}   ${textOf("right_hand")}: ${right}` : `${textOf("hand")}: ${right}`, COLOURS.text, true);
  line(hud.bins.map((bin) => `${bin.label}: ${bin.place.replace("\n", " ")}`).join("   "), COLOURS.faint);
}
