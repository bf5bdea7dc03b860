// Plays the film, reports how much of it was played, and asks the participant to play a film that is required.

import "./form.js";

import { byId, within } from "../dom.js";

const ENOUGH = 0.95; // fraction of a required film that must be played, as on the server

const form = within(document, "form", HTMLFormElement);
const film = within(form, "video", HTMLVideoElement);

const play = byId("play-film", HTMLButtonElement);
play.hidden = false;
play.addEventListener("click", () => film.play().then(() => film.focus(), () => {})); // the video reports errors itself
for (const event of ["play", "error"]) film.addEventListener(event, () => (play.hidden = true));

/** @param {string} name @param {string} value */
const tell = (name, value) => (within(form, `[name=${name}]`, HTMLInputElement).value = value);

function playedSeconds() {
  let seconds = 0;
  for (let i = 0; i < film.played.length; i++) seconds += film.played.end(i) - film.played.start(i);
  return seconds;
}

form.addEventListener("submit", (event) => {
  const [played, duration] = [playedSeconds(), film.duration || 0];
  tell("played_s", played.toFixed(1));
  tell("film_s", duration ? duration.toFixed(1) : "");
  tell("film_error", film.error ? String(film.error.code) : "");
  const skips = event.submitter instanceof HTMLButtonElement && event.submitter.name === "skip";
  if (!("required" in film.dataset) || film.error || skips || (duration && played >= ENOUGH * duration)) return;
  event.preventDefault();
  byId("unplayed", HTMLElement).hidden = false;
});
