// @vitest-environment happy-dom
import { beforeEach, describe, expect, test, vi } from "vitest";

import { Hud } from "../static/hud.js";
import { giveTexts } from "./page.js";

/** @import { ChecklistItem, HudState, Moment } from "../static/protocol.js" */

/** @param {Partial<ChecklistItem>} more @returns {ChecklistItem} */
const item = (more) => ({
  text: "Mug", detail: "Kitchen\n→ Dish bin", picture: null, target_picture: null, number: null, done: false, current: false,
  carried: false, ...more,
});

/** @param {Partial<HudState>} more @returns {HudState} */
const state = (more) => ({
  checklist_title: "Objects to find", checklist: [], bins: [], inventory: [{ label: "Pan", picture: null }, { label: null, picture: null }],
  message: null, markers: [], rerouted: false, delivered: 1, total: 6, clock: null, pointer: null, minimap: null, scroll: 0, ...more,
});

/** @param {Partial<Moment>} more @returns {Moment} */
const moment = (more) => ({ type: "moment", step: 1, clock: 83.9, room: "Hall", reach: null, pointer: null, minimap: null, ...more });

/** @param {string} id */
const part = (id) => /** @type {HTMLElement} */ (document.getElementById(id));

describe("the display", () => {
  /** @type {Hud} */
  let hud;
  beforeEach(() => {
    vi.useFakeTimers();
    document.body.innerHTML =
      '<p id="progress"></p><p id="clock"></p><p id="room"></p><h2 id="list-title"></h2><ul id="list"></ul><div id="pointer" hidden></div>' +
      '<button id="reach" hidden></button><p id="message"></p><ul id="hands"></ul><ul id="bins"></ul><canvas id="map"></canvas><div id="view"></div>';
    giveTexts();
    hud = new Hud(() => "E");
  });

  test("counts what is in the hands once nothing is left to find", () => {
    hud.show(state({ checklist: [item({ done: true }), item({ done: true, carried: true })] }));
    expect(document.getElementById("list-title")?.textContent).toContain("0 left to find, 1 in your hands");
    hud.show(state({ checklist: [item({ done: true })] }));
    expect(document.getElementById("list-title")?.textContent).toContain("none left");
  });

  test("tells what is carried from what is done", () => {
    hud.show(state({ checklist: [item({}), item({ done: true }), item({ done: true, carried: true })] }));
    const rows = [...part("list").children];
    expect(rows.map((row) => row.className)).toEqual(["", "done", "carried"]);
    expect(rows.map((row) => row.textContent)).toEqual(["MugKitchen → Dish bin", "Done: MugKitchen → Dish bin", "MugIn your hand"]);
    expect(part("list-title").textContent).toBe("Objects to find: 1 left");
  });

  test("counts steps, progress, and says what the hands hold", () => {
    hud.show(state({ checklist: [item({ number: 1, done: true }), item({ number: 2, current: true })] }));
    expect(part("list-title").textContent).toBe("Objects to find: step 2 / 2");
    expect(part("list").children[1]?.getAttribute("aria-current")).toBe("step");
    expect(part("progress").textContent).toBe("1 / 6 put away");
    expect(part("hands").textContent).toBe("Left handPanRight handempty");
    hud.show(state({ inventory: [null, { label: null, picture: null }] }));
    expect(part("hands").textContent).toBe("Handempty");
  });

  test("marks what the action key would take, and where it would put it", () => {
    hud.expect(moment({ reach: { object: "Mug", receptacle: null, at: [0.5, 0.25], instance: "object_00", place: [1, 2, 0] } }));
    expect(hud.reach).toBe(false); // its frame is not on show yet
    hud.reached(1);
    expect([hud.reach, part("reach").textContent, part("reach").style.getPropertyValue("--y")]).toEqual([true, "E Pick up Mug", "0.25"]);
    hud.expect(moment({ step: 2, reach: { object: "Mug", receptacle: "Dish bin", at: null, instance: "object_00", place: [3, 4, 1] } }));
    hud.reached(2);
    expect([part("reach").textContent, part("reach").classList.contains("away")]).toEqual(["E Put Mug into Dish bin", true]);
    hud.expect(moment({ step: 3 }));
    vi.runAllTimers(); // no frame comes where nothing has moved
    expect([part("reach").hidden, part("room").textContent, part("clock").textContent]).toEqual([true, "Hall", "1:23"]);
  });

  test("is tapped where it is, and only while it is in reach", () => {
    part("view").getBoundingClientRect = () => new DOMRect(100, 50, 800, 600);
    const reach = { object: "Mug", receptacle: null, instance: "object_00", place: /** @type {[number, number, number]} */ ([1, 2, 0]) };
    hud.showMoment(moment({ reach: { ...reach, at: [0.5, 0.25] } }));
    expect([hud.isReached(500, 200), hud.isReached(540, 240), hud.isReached(500, 400)]).toEqual([true, true, false]);
    hud.showMoment(moment({ reach: { ...reach, at: null } }));
    expect(hud.isReached(500, 200)).toBe(false);
    hud.showMoment(moment({}));
    expect(hud.isReached(500, 200)).toBe(false);
  });

  test("its label never leaves the view, and is not read out twice", () => {
    const reach = { object: "Mug", receptacle: null, instance: "object_00", place: /** @type {[number, number, number]} */ ([1, 2, 0]) };
    hud.showMoment(moment({ reach: { ...reach, at: [0.98, 0.5] } }));
    expect(part("reach").style.getPropertyValue("--x")).toBe("0.98");
    const [key] = part("reach").children;
    hud.showMoment(moment({ reach: { ...reach, at: [0.5, 0.5] } }));
    expect(part("reach").children[0]).toBe(key); // a live region reads new nodes
  });

  test("shows pictures that come later, and keeps the current row of a long list in sight", () => {
    const rows = Array.from({ length: 9 }, (_, i) => item({ picture: "mug", current: i === 6 }));
    vi.spyOn(HTMLElement.prototype, "offsetTop", "get").mockImplementation(/** @this {Element} */ function () {
      return 10 * [...part("list").children].indexOf(this);
    });
    hud.show(state({ checklist: rows, bins: [{ label: "Bin", place: "Kitchen\nleft", picture: "bin" }] }));
    expect(part("list").querySelectorAll("img")).toHaveLength(0);
    hud.learn({ type: "pictures", pictures: { mug: "data:,mug", bin: "data:,bin" }, example: { mug: "Mug", bin: "Bin" }, markers: [] });
    expect(hud.example).toEqual([["data:,mug", "Mug"], ["data:,bin", "Bin"]]);
    expect([part("list").querySelectorAll("img").length, part("bins").textContent]).toEqual([9, "BinKitchen left"]);
    expect(part("list").scrollTop).toBe(50); // two rows above it, and the list itself is at -10
    hud.show(state({ checklist: rows, scroll: -3 }));
    expect(part("list").scrollTop).toBe(20);
    vi.restoreAllMocks();
  });

  test("has a map with north up, on which the person looks where they go", () => {
    /** @type {[string, ...number[]][]} */
    const calls = [];
    const noted = (/** @type {string} */ name) => (/** @type {number[]} */ ...values) => calls.push([name, ...values]);
    const names = ["beginPath", "arc", "fill", "translate", "rotate", "lineTo", "closePath", "stroke", "drawImage"];
    const map = /** @type {HTMLCanvasElement} */ (part("map"));
    map.getContext = /** @type {any} */ (() => Object.fromEntries(names.map((name) => [name, noted(name)])));
    const minimap = { picture: "house", bounds: [-2, 0, 8, 5], position: [0, 1], heading: Math.PI / 2, path: [[1, 1]], objects: [[2, 2]], goal: [8, 5] };
    hud.showMoment(moment({ minimap: /** @type {Moment["minimap"]} */ (minimap) }));
    expect([map.hidden, map.width, map.height]).toEqual([false, 400, 200]);
    const discs = calls.filter(([name]) => name === "arc").map(([, x, y]) => [x, y]);
    expect(discs).toEqual([[120, 160], [120, 160], [160, 120], [160, 120], [400, 0], [400, 0]]);
    expect(calls.filter(([name]) => name === "translate" || name === "rotate")).toEqual([["translate", 80, 160], ["rotate", -Math.PI / 2]]);
    hud.showMoment(moment({}));
    expect(map.hidden).toBe(true);
  });
});
