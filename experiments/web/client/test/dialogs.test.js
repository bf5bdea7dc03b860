// @vitest-environment happy-dom
import { beforeEach, describe, expect, test, vi } from "vitest";

import * as dialogs from "../static/dialogs.js";
import { Panel } from "../static/panel.js";
import { giveTexts } from "./page.js";

/** @import { PageState } from "../static/page_state.js" */

beforeEach(giveTexts);

/** @param {Parameters<typeof dialogs.dialogOf>[0]} shown @param {object} [state] of the page @param {number} [left] s */
const of = (shown, state = {}, left = 0) => dialogs.dialogOf(shown, /** @type {PageState} */ (state), left, "", false);

describe("dialogs", () => {
  test.each(["asked", "hidden", "disconnected", "silent", "restarted", "taken over"])("say why a session is paused: %s", (reason) => {
    expect(of("paused", { reason })).toMatchObject({ title: "Paused", texts: [expect.stringMatching(/\.$/)] });
  });

  test("count objects", () => {
    expect(dialogs.instructions("task", 1, true, [], null).texts[0]).toContain("the object into its bin");
    expect(dialogs.instructions("task", 6, true, [], null).texts[0]).toContain("all 6 objects into their bins");
  });

  test("congratulate on nothing but the whole task", () => {
    expect(of("over", { reason: "all delivered" }).title).toBe("All done");
    for (const reason of ["interrupted", "time limit"]) expect(of("over", { reason, saved: true }).title).not.toContain("one");
  });

  test.each(["training", "task"])("explain the controls before the %s, on touch screens in words", (trial) => {
    const { keys = [], texts } = dialogs.instructions(trial, 1, true, [], (name) => `<${name}>`);
    expect(keys).toContainEqual([["<forward>", "<left>", "<back>", "<right>"], "Walk"]);
    expect(keys).toContainEqual([["<act>"], "Pick up or place"]);
    const touch = dialogs.instructions(trial, 1, true, [], null);
    expect([texts.length, touch.keys, touch.texts[1]]).toEqual([1, [], expect.stringContaining("lower left")]);
  });

  test("say whether the page was interrupted", () => {
    expect(of("loading", { wanted: true }).texts).not.toEqual(of("loading").texts);
  });

  test("offer no end of a training before its time", () => {
    const ends = (/** @type {dialogs.Dialog} */ { buttons = [] }) => buttons.some(([, action]) => action === "leave");
    for (const early of [true, false]) {
      expect(ends(dialogs.instructions("training", 1, !early, [], null))).toBe(!early);
      expect(ends(of("ending", {}, early ? 12 : 0))).toBe(!early);
    }
    expect(of("ending", {}, 12).texts[0]).toContain("in 12 s");
  });

  test("run the actions of their buttons", () => {
    document.body.innerHTML =
      '<dialog><h2></h2><div id="panel-text"></div><div id="panel-actions"></div></dialog>';
    const dialog = document.querySelector("dialog");
    if (!dialog) throw new Error("no dialog");
    const run = vi.fn();
    const closed = vi.fn();
    const panel = new Panel(dialog, { run }, closed);
    panel.show(of("paused", { reason: "asked" }));
    expect([dialog.open, dialog.querySelector("h2")?.textContent, document.activeElement?.textContent]).toEqual([true, "Paused", "Continue"]);
    dialog.querySelector("button")?.click();
    expect(run).toHaveBeenCalledOnce();
    panel.hide();
    panel.hide();
    expect(closed).toHaveBeenCalledOnce();
  });
});
