// @vitest-environment happy-dom
import { beforeAll, expect, test } from "vitest";

import { made } from "../static/dom.js";
import { showPage } from "./page.js";

const HOMES = [[3, 50], [1, 30], [3, 40]]; // number of rooms and area in m2

/** @param {string} id */
const part = (id) => /** @type {any} */ (document.getElementById(id));
const shown = () => [...part("homes").children].map((home) => Number(home.dataset.number));

/** Returns the homes that are listed for a choice of filters. @param {Record<string, string>} values */
function chosen(values) {
  for (const [name, value] of Object.entries(values)) {
    /** @type {HTMLInputElement} */ (part("choice").querySelector(`[name=${name}]`)).value = value;
  }
  part("choice").dispatchEvent(new Event("input"));
  return shown();
}

beforeAll(async () => {
  showPage("gallery");
  part("choice").querySelector("[name=rooms]").append(made("option", "3"));
  part("homes").replaceChildren(...HOMES.map(([rooms, area], i) => {
    const home = document.createElement("li");
    Object.assign(home.dataset, { number: `${i + 1}`, rooms: `${rooms}`, area: `${area}` });
    return home;
  }));
  await import("../static/gallery.js");
});

test("homes are listed in the original order or sorted by another one", () => {
  expect(shown()).toEqual([1, 2, 3]);
  expect(chosen({ order: "rooms" })).toEqual([2, 1, 3]);
  expect(chosen({ order: "area" })).toEqual([2, 3, 1]);
  expect(chosen({ order: "largest" })).toEqual([1, 3, 2]);
});

test("homes can be filtered by number of rooms and area", () => {
  expect(chosen({ order: "number", rooms: "3" })).toEqual([1, 3]);
  expect(part("count").textContent).toBe("2 of 3 homes");
  expect(chosen({ least: "45" })).toEqual([1]);
  expect(chosen({ rooms: "", least: "", most: "40" })).toEqual([2, 3]);
});
