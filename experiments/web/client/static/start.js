// Offers to continue the visit that was started in this browser. The link is then the page's main button.

import "./wait.js";

import { byId, within } from "./dom.js";
import { lastVisit } from "./visit.js";

const link = lastVisit();
if (link) {
  const offer = byId("continue", HTMLElement);
  const main = within(offer, "a", HTMLAnchorElement);
  main.href = link;
  offer.hidden = false;
  document.querySelector("form .button")?.classList.remove("button");
  main.focus({ preventScroll: true });
}
