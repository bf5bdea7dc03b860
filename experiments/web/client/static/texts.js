// The texts of the page in its language, which the server writes into the page.

import { byId } from "./dom.js";

/** @type {Record<string, string> | null} */
let texts = null;

/**
 * A text by its name, with values in its places.
 * @param {string} name
 * @param {Record<string, string | number>} values by the names of the places
 */
export function textOf(name, values = {}) {
  texts ??= /** @type {Record<string, string>} */ (JSON.parse(byId("texts", HTMLScriptElement).text));
  const found = texts[name];
  if (found === undefined) throw new Error(`the page has no text ${name}`);
  return found.replace(/\{(\w+)\}/g, (place, key) => `${values[key] ?? place}`);
}
