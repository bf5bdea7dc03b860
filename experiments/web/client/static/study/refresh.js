// Updates parts of a page every few seconds. Without scripts, there is a link, or the page reloads itself.

const parts = /** @type {HTMLElement[]} */ ([...document.querySelectorAll("[data-live]")]);
const period = Number(parts[0]?.dataset["live"]); // in s; 0 for a page that need not be updated while it is hidden

async function update() {
  const answer = period || !document.hidden ? await fetch(location.href).catch(() => null) : null; // the server may be restarting
  if (answer?.redirected) return location.reload(); // the login has expired
  if (answer?.ok) {
    const page = new DOMParser().parseFromString(await answer.text(), "text/html");
    for (const part of parts) {
      const now = page.getElementById(part.id);
      if (!now) return location.reload(); // the participant need not wait any longer
      if (now.innerHTML !== part.innerHTML) part.replaceChildren(...now.childNodes);
    }
  }
  setTimeout(update, 1000 * (period || 5));
}

setTimeout(update, 1000 * (period || 5));
export {};
