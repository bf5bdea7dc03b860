// The text of the display, for screen readers.

/** @import { Text } from "./protocol.js" */

import { byId, made } from "./dom.js";

/** @param {Text} text */
export function showText({ message, title, rows, hands }) {
  const bar = byId("message", HTMLElement);
  if (bar.textContent !== message) bar.textContent = message; // the same text again would be read again
  byId("list-title", HTMLElement).textContent = title;
  byId("list", HTMLElement).replaceChildren(...rows.map((row) => made("li", row)));
  const names = hands.length === 1 ? ["Hand"] : ["Left hand", "Right hand"];
  byId("hands", HTMLElement).textContent = hands.map((held, i) => `${names[i]}: ${held}.`).join(" ");
}
