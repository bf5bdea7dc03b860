// Values stored in this browser. Private windows may store nothing.

/**
 * @param {string} name
 * @returns {any} null if nothing is stored
 */
export function load(name) {
  try {
    return JSON.parse(localStorage.getItem(name) ?? "null");
  } catch {
    return null;
  }
}

/** @param {string} name @param {unknown} value null to forget it */
export function save(name, value) {
  try {
    localStorage.setItem(name, JSON.stringify(value));
  } catch {
    // Nothing is kept.
  }
}

export function forgetAll() {
  try {
    localStorage.clear();
    sessionStorage.clear();
  } catch {
    // Nothing is kept.
  }
}
