// The visit is over; the first page need not offer to continue it. Where people share a browser, as in a lab, nothing
// of a person is left in it, settings included.

import { forgetAll } from "./store.js";
import { forgetVisit } from "./visit.js";

forgetVisit();
if (document.querySelector("script[data-forgets]")) forgetAll();
