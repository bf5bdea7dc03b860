// What the display says, as text for screen readers.

import { made } from "./panel.js";

const byId = (id) => document.getElementById(id);

export function showText({ message, title, rows, hands }) {
  if (byId("said").textContent !== message) byId("said").textContent = message;
  byId("list-title").textContent = title;
  byId("list").replaceChildren(...rows.map((row) => made("li", row)));
  const names = hands.length === 1 ? ["Hand"] : ["Left hand", "Right hand"];
  byId("hands").textContent = hands.map((held, i) => `${names[i]}: ${held}.`).join(" ");
}
