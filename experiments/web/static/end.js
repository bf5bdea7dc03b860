// The visit is over; the first page need not offer to go on with it.

import { forgetVisit } from "./visit.js";

forgetVisit();
