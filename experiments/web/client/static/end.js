// Forgets a visit that is over, so that the first page does not offer to continue it. In a shared browser, as in a
// lab, it also forgets the settings.

import { forgetAll } from "./store.js";
import { forgetVisit } from "./visit.js";

forgetVisit();
if (document.querySelector("script[data-forgets]")) forgetAll();
