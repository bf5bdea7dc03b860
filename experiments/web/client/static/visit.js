// The link of the visit that was started in this browser, stored only here.

import { load, save } from "./store.js";

const NAME = "mjsim-visit";

export const rememberVisit = () => save(NAME, location.pathname);
export const forgetVisit = () => save(NAME, null);

/** The link, or null. */
export function lastVisit() {
  const link = load(NAME);
  return typeof link === "string" && /^\/play\/[\w-]{43}$/.test(link) ? link : null;
}
