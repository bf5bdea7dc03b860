// Offers to go on with the visit that this browser began.

import { lastVisit } from "./visit.js";

const link = lastVisit();
if (link) {
  const offer = document.getElementById("continue");
  offer.querySelector("a").href = link;
  offer.hidden = false;
}
