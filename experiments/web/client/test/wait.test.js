// @vitest-environment happy-dom
import { expect, test, vi } from "vitest";

test("a delayed button counts down and then receives the focus", async () => {
  vi.useFakeTimers();
  document.body.innerHTML = '<button data-wait="2">Begin</button><button data-wait="0">Continue</button>';
  const [begin, go] = document.querySelectorAll("button");
  if (begin) begin.autofocus = true;
  await import("../static/start.js");
  expect([begin?.disabled, begin?.textContent, go?.disabled, go?.textContent]).toEqual([true, "Begin (in 2 s)", false, "Continue"]);
  vi.advanceTimersByTime(1250);
  expect(begin?.textContent).toBe("Begin (in 1 s)");
  vi.advanceTimersByTime(750);
  expect([begin?.disabled, begin?.textContent, document.activeElement]).toEqual([false, "Begin", begin]);
});

test("a button below a long text receives the focus without scrolling the page", async () => {
  document.body.innerHTML = '<button data-wait="0" data-focus>Continue</button>';
  const [button] = document.querySelectorAll("button");
  const focus = vi.spyOn(HTMLElement.prototype, "focus");
  vi.resetModules();
  await import("../static/start.js");
  expect(focus.mock.calls).toEqual([[{ preventScroll: true }]]);
  expect([document.activeElement, button?.disabled, button?.textContent]).toEqual([button, false, "Continue"]);
});
