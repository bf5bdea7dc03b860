// Events of the page: hidden, focus lost, closed, resized.

const HIDDEN_GRACE = 5000; // how long the page may be hidden before the session is paused, in ms
const RESIZED = 300; // delay before a new size of the page is reported, in ms

/**
 * @typedef {object} Reactions
 * @property {() => void} release release all keys
 * @property {() => void} hidden the page was hidden for too long
 * @property {(away: boolean) => void} blur the page lost or regained the focus
 * @property {() => void} close
 * @property {() => void} resize at once
 * @property {() => void} resized once the size is stable
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
  window.addEventListener("resize", resize); // also when the pixel ratio of the screen changes
  new ResizeObserver(resize).observe(view);
}
