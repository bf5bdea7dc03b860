// Polls for a free place and updates the text in place. Without scripts, the page reloads itself.

import { byId } from "../dom.js";

const queue = byId("queue", HTMLElement);
const period = 1000 * Number(queue.dataset["refresh"]);

async function ask() {
  const answer = await fetch(location.pathname).catch(() => null); // the server may be restarting
  if (answer?.ok) {
    const page = new DOMParser().parseFromString(await answer.text(), "text/html");
    const now = page.getElementById("queue");
    if (!now) return location.reload();
    if (now.textContent !== queue.textContent) queue.replaceChildren(...now.childNodes);
  }
  setTimeout(ask, period);
}

setTimeout(ask, period);
