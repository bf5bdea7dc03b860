// The page of `mjsim house gallery`, which filters and sorts its homes.

import { byId } from "./dom.js";

const choice = byId("choice", HTMLFormElement);
const list = byId("homes", HTMLElement);
const homes = /** @type {HTMLElement[]} */ ([...list.children]);

function show() {
  const wanted = new FormData(choice);
  const [least, most, order] = ["least", "most", "order"].map((name) => `${wanted.get(name) ?? ""}`);
  /** @param {HTMLElement} home @param {string} [key] */
  const value = ({ dataset }, key = "area") => Number(dataset[key]);
  const shown = homes.filter((home) => ["", home.dataset.rooms].includes(`${wanted.get("rooms")}`)
    && value(home) >= Number(least) && value(home) <= Number(most || Infinity));
  shown.sort((a, b) => order === "largest" ? value(b) - value(a) : value(a, order) - value(b, order));
  list.replaceChildren(...shown);
  byId("count", HTMLElement).textContent = `${shown.length} of ${homes.length} homes`;
}

choice.addEventListener("input", show);
show();
