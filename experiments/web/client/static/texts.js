// The texts of the page in its language, which the server writes into the page.

import { byId } from "./dom.js";

/** @type {Record<string, string> | null} */
let texts = null;

/**
 * Returns a text by its name, with its placeholders filled.
 * @param {string} name
 * @param {Record<string, string | number>} values of the placeholders
 */
export function textOf(name, values = {}) {
  texts ??= /** @type {Record<string, string>} */ (JSON.parse(byId("texts", HTMLScriptElement).text));
  const found = texts[name];
  if (found === undefined) throw new Error(`the page has no text ${name}`);
  return found.replace(/\{(\w+)\}/g, (place, key) => `${values[key] ?? place}`);
}
