// What happens to the page: hidden, left by the keyboard, closed, resized.

const HIDDEN_GRACE = 5000; // ms that the page may be hidden before the session is paused
const RESIZED = 300; // ms after which a new size of the page is told

/**
 * @typedef {object} Reactions
 * @property {() => void} release nothing is held any more
 * @property {() => void} hidden the page was hidden for long
 * @property {(away: boolean) => void} blur the keyboard is elsewhere, or is back
 * @property {() => void} close
 * @property {() => void} resize at once
 * @property {() => void} resized once the size stays
 */

/** @param {HTMLElement} view whose size counts, also where text around it grows @param {Reactions} on */
export function watchPage(view, on) {
  let hidden = 0;
  document.addEventListener("visibilitychange", () => {
    clearTimeout(hidden);
    if (!document.hidden) return;
    on.release();
    hidden = window.setTimeout(on.hidden, HIDDEN_GRACE);
  });
  window.addEventListener("blur", () => {
    on.release();
    on.blur(true);
  });
  window.addEventListener("focus", () => on.blur(false));
  window.addEventListener("pagehide", on.close);
  let resized = 0;
  const resize = () => {
    on.resize();
    clearTimeout(resized);
    resized = window.setTimeout(on.resized, RESIZED);
  };
  window.addEventListener("resize", resize); // also where the screen has other pixels
  new ResizeObserver(resize).observe(view);
}
