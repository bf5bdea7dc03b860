// Offers to continue where this browser has the link of a visit, which shows the server who asks.

import { byId, within } from "../dom.js";
import { lastVisit } from "../visit.js";

const link = lastVisit();
if (link) {
  const form = byId("continue", HTMLFormElement);
  within(form, "[name=token]", HTMLInputElement).value = link.slice("/play/".length);
  form.hidden = false;
}
