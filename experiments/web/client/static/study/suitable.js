// Tells participants on the first page if their device cannot pass the check of the computer.

import { byId } from "../dom.js";

const note = byId("unsuitable", HTMLElement);
const touchOnly = matchMedia("(hover: none) and (pointer: coarse)").matches;
const tooSmall = Math.max(screen.width, screen.height) < Number(note.dataset["width"]);
note.hidden = !(tooSmall || (touchOnly && note.dataset["keyboard"] === "yes"));
