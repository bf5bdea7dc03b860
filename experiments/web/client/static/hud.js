// The heads-up display: lists next to the view, and elements on top of it.

/** @import { BinEntry, ChecklistItem, HudState, InventorySlot, Moment, Pictures, Reach } from "./protocol.js" */

import { byId, made } from "./dom.js";
import { drawMap } from "./map.js";
import { textOf } from "./texts.js";

const CONTEXT = 2; // rows kept visible above the current one
const TAPPED = 0.1; // farthest tap from the middle of an object that counts as a tap on it, as a share of the view's width
const LATEST = 200; // longest wait of a moment for its frame, in ms
const SYMBOLS = { info: "ℹ", success: "✓", refusal: "✕" };

/** Elements on top of the view wait for the frame that they belong to. */
export class Hud {
  /** @type {Map<string, HTMLImageElement>} */
  #pictures = new Map();
  /** @type {[string, string][]} */
  example = []; // addresses and labels of the pictures in the instructions
  /** @type {string[]} */
  roles = []; // roles of the markers in the picture of the instructions
  markers = ""; // address of that picture
  /** @type {Moment[]} */
  #waiting = [];
  /** @type {HudState | null} */
  #state = null;
  #key;
  reach = false; // true if the action key would do something
  /** @type {[number, number] | null} */
  #at = null; // where the object in reach is, in shares of the view

  /** @param {() => string} key name of the action key */
  constructor(key) {
    this.#key = key;
    window.addEventListener("resize", () => this.#scroll());
  }

  /** @param {Pictures} message */
  learn({ pictures, example, markers }) {
    [this.roles, this.markers] = [markers, pictures["markers"] ?? ""];
    this.example = Object.entries(example).map(([key, label]) => [pictures[key] ?? "", label]);
    for (const [key, address] of Object.entries(pictures)) {
      const image = new Image();
      image.alt = ""; // the label next to it has the name
      image.src = address;
      this.#pictures.set(key, image);
    }
    if (this.#state) this.show(this.#state);
  }

  /** @param {HudState} state */
  show(state) {
    this.#state = state;
    byId("list-title", HTMLElement).textContent = `${state.checklist_title}: ${countText(state.checklist)}`;
    byId("list", HTMLElement).replaceChildren(...state.checklist.map((item) => this.#row(item)));
    byId("bins", HTMLElement).replaceChildren(...state.bins.map((bin) => this.#bin(bin)));
    byId("hands", HTMLElement).replaceChildren(...this.#hands(state.inventory));
    byId("progress", HTMLElement).textContent = textOf("progress", { count: state.delivered, all: state.total });
    const text = state.message ? `${SYMBOLS[state.message.kind]} ${state.message.text}` : "";
    const bar = byId("message", HTMLElement);
    if (bar.textContent !== text) bar.textContent = text; // setting the same text would make a screen reader repeat it
    bar.className = state.message?.kind ?? "";
    this.#scroll();
  }

  /** @param {Moment} moment */
  expect(moment) {
    this.#waiting.push(moment);
    setTimeout(() => this.reached(moment.step), LATEST);
  }

  /** @param {number} step control step of the shown frame */
  reached(step) {
    const due = this.#waiting.filter((moment) => moment.step <= step);
    this.#waiting = this.#waiting.slice(due.length);
    const moment = due.at(-1);
    if (moment) this.showMoment(moment);
  }

  /** @param {Moment} moment */
  showMoment({ clock, room, reach, pointer, minimap }) {
    byId("clock", HTMLElement).textContent = clock === null ? "" : clockText(clock);
    byId("room", HTMLElement).textContent = room;
    this.#reach(reach);
    const arrow = byId("pointer", HTMLElement);
    arrow.hidden = !pointer;
    if (pointer) {
      const [x, y] = [Math.cos(pointer.angle), -Math.sin(pointer.angle)];
      const far = 44 / Math.max(Math.abs(x), Math.abs(y)); // distance to the edge, in % of the view
      arrow.style.left = `${50 + far * x}%`;
      arrow.style.top = `${50 + far * y}%`;
      arrow.style.rotate = `${-pointer.angle}rad`;
    }
    drawMap(byId("map", HTMLCanvasElement), minimap, minimap && this.#pictures.get(minimap.picture));
  }

  /** @param {Reach | null} reach */
  #reach(reach) {
    const mark = byId("reach", HTMLButtonElement);
    this.reach = reach !== null;
    mark.hidden = !reach;
    if (!reach) return;
    const values = { Object: reach.object, Receptacle: reach.receptacle ?? "" };
    const what = textOf(reach.receptacle ? "put_into" : "pick_up_object", values);
    const label = [made("kbd", this.#key()), " ", made("span", what)];
    // It is in a live region: setting the same label would make a screen reader repeat it.
    if (mark.textContent !== `${this.#key()} ${what}`) mark.replaceChildren(...label);
    this.moveReach(reach.at);
  }

  /** Moves the mark of the object in reach to a position in shares of the view. @param {[number, number] | null} at */
  moveReach(at) {
    this.#at = at;
    const mark = byId("reach", HTMLElement);
    mark.classList.toggle("away", !at);
    const [x, y] = at ?? [0.5, 0.9];
    mark.style.setProperty("--x", `${Math.min(Math.max(x, 0), 1)}`);
    mark.style.setProperty("--y", `${y}`);
  }

  /** Returns true if a point of the page is on the object in reach. @param {number} x px @param {number} y px */
  isReached(x, y) {
    if (!this.reach || !this.#at) return false;
    const { left, top, width, height } = byId("view", HTMLElement).getBoundingClientRect();
    return Math.hypot(x - left - this.#at[0] * width, y - top - this.#at[1] * height) < TAPPED * width;
  }

  /** @param {ChecklistItem} item */
  #row(item) {
    const detail = item.carried ? textOf("in_hand") : item.detail.replace("\n", " ");
    const words = [made("b", item.text), made("small", detail)];
    if (item.done && !item.carried) words.unshift(hidden(`${textOf("item_done")}: `));
    const row = this.#listed(item.picture, words);
    if (item.number !== null) row.prepend(made("i", `${item.number}`));
    row.append(...this.#picture(item.target_picture));
    row.className = item.carried ? "carried" : item.done ? "done" : "";
    if (item.current) row.setAttribute("aria-current", "step");
    return row;
  }

  /** @param {BinEntry} bin */
  #bin(bin) {
    return this.#listed(bin.picture, [made("b", bin.label), made("small", bin.place.replace("\n", " "))]);
  }

  /** @param {(InventorySlot | null)[]} slots */
  #hands(slots) {
    const names = slots[0] ? [textOf("left_hand"), textOf("right_hand")] : ["", textOf("hand")];
    return slots.flatMap((slot, i) =>
      slot ? [this.#listed(slot.picture, [made("small", names[i] ?? ""), made("b", slot.label ?? textOf("empty"))])] : [],
    );
  }

  /** Returns a row of a list. @param {string | null} picture @param {HTMLElement[]} words */
  #listed(picture, words) {
    const [row, text] = [made("li", ""), made("span", "")];
    text.append(...words);
    row.append(...this.#picture(picture), text);
    return row;
  }

  /** @param {string | null} key */
  #picture(key) {
    const image = key === null ? undefined : this.#pictures.get(key);
    return image ? [/** @type {Node} */ (image.cloneNode())] : [];
  }

  /** Scrolls to the current step and by the person's scrolling. */
  #scroll() {
    if (!this.#state) return;
    const list = byId("list", HTMLElement);
    const { checklist, scroll } = this.#state;
    const current = Math.max(0, checklist.findIndex((item) => item.current) - CONTEXT);
    const first = list.children[Math.min(Math.max(current + scroll, 0), checklist.length - 1)];
    if (first instanceof HTMLElement) list.scrollTop = first.offsetTop - list.offsetTop;
  }
}

/** @param {ChecklistItem[]} items */
function countText(items) {
  const left = items.filter((item) => !item.done).length;
  const numbered = items.some((item) => item.number !== null);
  const carried = items.filter((item) => item.carried).length;
  if (!left && !numbered && carried) return textOf("none_left_carried", { count: carried });
  if (!left) return textOf(numbered ? "done" : "none_left");
  if (!numbered) return textOf("left", { count: left });
  return textOf("next_step", { number: items.length - left + 1, count: items.length });
}

/** @param {string} text only for screen readers */
function hidden(text) {
  const element = made("span", text);
  element.className = "hidden";
  return element;
}

/** @param {number} seconds */
export function clockText(seconds) {
  const minutes = Math.floor(seconds / 60);
  return `${minutes}:${String(Math.floor(seconds % 60)).padStart(2, "0")}`;
}
