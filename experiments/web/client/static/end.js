// The visit is over; the first page need not offer to continue it.

import { forgetVisit } from "./visit.js";

forgetVisit();
