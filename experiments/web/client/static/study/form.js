// Saves answers as they are given, so that closing the page loses nothing.

import "../wait.js";

import { rememberVisit } from "../visit.js";

const PAUSE = 500; // delay after the last key before a text is saved, in ms

rememberVisit();

const form = document.querySelector("form");
const address = form?.dataset["save"];
if (form && address) {
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;
  const save = () => {
    clearTimeout(timer);
    const body = new URLSearchParams();
    for (const [name, value] of new FormData(form)) body.append(name, String(value));
    fetch(address, { method: "POST", body, keepalive: true }).catch(() => {}); // the form itself is sent later
  };
  form.addEventListener("change", save);
  form.addEventListener("input", () => {
    clearTimeout(timer);
    timer = setTimeout(save, PAUSE);
  });
  form.addEventListener("submit", () => clearTimeout(timer));
}
