// Offers to continue if this browser has the link of the visit, which proves the identity.

import { byId, within } from "../dom.js";
import { lastVisit } from "../visit.js";

const link = lastVisit();
if (link) {
  const form = byId("continue", HTMLFormElement);
  within(form, "[name=token]", HTMLInputElement).value = link.slice("/play/".length);
  form.hidden = false;
}
