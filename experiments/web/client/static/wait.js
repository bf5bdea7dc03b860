// Buttons that can be used after a while, with the seconds that are left. A button with data-focus gets the focus once it
// can be used, but is not scrolled into view as with autofocus: a reader begins at the top.

for (const button of document.querySelectorAll("button[data-wait]")) {
  if (!(button instanceof HTMLButtonElement)) continue;
  const [text, until] = [button.textContent, performance.now() + 1000 * Number(button.dataset.wait)];
  const show = () => {
    const left = Math.ceil((until - performance.now()) / 1000);
    button.disabled = left > 0;
    button.textContent = left > 0 ? `${text} (in ${left} s)` : text;
    if (left > 0) setTimeout(show, 250);
    else if (button.autofocus || "focus" in button.dataset) button.focus({ preventScroll: true }); // a disabled button had lost it
  };
  if (Number(button.dataset.wait) > 0 || "focus" in button.dataset) show();
}
