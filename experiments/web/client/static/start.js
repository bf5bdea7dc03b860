// Offers to continue the visit that was started in this browser.

import "./wait.js";

import { byId, within } from "./dom.js";
import { lastVisit } from "./visit.js";

const link = lastVisit();
if (link) {
  const offer = byId("continue", HTMLElement);
  within(offer, "a", HTMLAnchorElement).href = link;
  offer.hidden = false;
}
