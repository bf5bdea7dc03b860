// Mouse look with pointer lock, the wheel, and touch.

/** @import { Inputs } from "./inputs.js" */

import { ACTIONS } from "./bindings.js";

const TURN_PER_PIXEL = 0.0025; // rad
const TURN_PER_TOUCHED_PIXEL = 0.006; // rad
const STILL = 10; // how far a finger may move during a tap, in pixels
const LINE = 40; // wheel movement per row, in pixels

/**
 * @param {HTMLCanvasElement} canvas
 * @param {Inputs} inputs
 * @param {() => boolean} listens whether inputs are for the view
 * @returns {{ sensitivity: number, inverted: boolean }} what may be changed: a factor, and whether forward looks down
 */
export function connectMouse(canvas, inputs, listens) {
  const mouse = { sensitivity: 1, inverted: false };
  canvas.addEventListener("click", (event) => {
    if ((event instanceof PointerEvent && event.pointerType === "touch") || !listens()) return;
    canvas.focus();
    const locked = document.pointerLockElement === canvas;
    if (locked || !canvas.requestPointerLock) inputs.press("act"); // the first click only captures the mouse
    // Browsers refuse this right after Esc. The next click asks again.
    if (!locked) canvas.requestPointerLock?.()?.catch?.(() => {});
  });
  document.addEventListener("mousemove", (event) => {
    if (document.pointerLockElement !== canvas || !listens()) return;
    const turn = TURN_PER_PIXEL * mouse.sensitivity;
    inputs.look(-event.movementX * turn, (mouse.inverted ? 1 : -1) * event.movementY * turn);
  });
  let rolled = 0;
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      if (!listens()) return;
      rolled += event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? event.deltaY : event.deltaY * LINE;
      const rows = Math.trunc(rolled / LINE);
      if (rows) inputs.scroll(rows);
      rolled -= rows * LINE;
    },
    { passive: false },
  );
  return mouse;
}

/**
 * @param {HTMLCanvasElement} canvas
 * @param {HTMLElement} buttons
 * @param {Inputs} inputs
 * @param {() => boolean} listens whether inputs are for the view
 * @param {(x: number, y: number) => boolean} isReached whether the object in reach is at a point of the page
 */
export function connectTouch(canvas, buttons, inputs, listens, isReached) {
  /** @type {PointerEvent | null} */
  let last = null;
  /** @type {PointerEvent | null} */
  let first = null; // start of a tap, null once the finger has moved
  canvas.addEventListener("pointerdown", (event) => {
    if (event.pointerType !== "touch") return;
    first = last = event;
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (event.pointerType !== "touch" || !last || last.pointerId !== event.pointerId || !listens()) return;
    inputs.look(
      (event.clientX - last.clientX) * TURN_PER_TOUCHED_PIXEL,
      (event.clientY - last.clientY) * TURN_PER_TOUCHED_PIXEL,
    );
    last = event;
    if (first && Math.hypot(event.clientX - first.clientX, event.clientY - first.clientY) > STILL) first = null;
  });
  canvas.addEventListener("pointerup", (event) => {
    if (first?.pointerId === event.pointerId && listens() && isReached(event.clientX, event.clientY)) inputs.press("act");
    first = null;
  });
  for (const button of buttons.querySelectorAll("button")) {
    const { hold: name, press, scroll } = button.dataset;
    if (!name) {
      button.addEventListener("click", () => {
        if (!listens()) return;
        const action = ACTIONS.find((found) => found.press === press);
        if (press && action?.press) inputs.press(action.press);
        else inputs.scroll(Number(scroll));
      });
      continue;
    }
    button.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      if (!listens()) return;
      button.setPointerCapture(event.pointerId);
      inputs.hold(name, ACTIONS.find((action) => action.name === name)?.axes ?? {});
    });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
      button.addEventListener(end, () => inputs.hold(name, {}));
    }
  }
}
