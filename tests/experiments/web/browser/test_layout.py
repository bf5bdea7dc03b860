"""Where things are on the page of a task, in windows of all shapes."""

from pathlib import Path

import experiments.web
from benchmarks.play import FAST
from benchmarks.support.play_server import PATIENCE, PlayProcess

STYLE = Path(experiments.web.__file__).parent / "client" / "static" / "style.css"
CHOICE = "<fieldset class=question><label><input type=radio> <span>{}</span></label></fieldset>"
SHAPES = {"wide": (1280, 720), "4:3": (1024, 768), "narrow": (800, 600), "phone": (390, 844)}
COVERED = 0.45  # share of the view that lists may cover where they have no room beside it
RECTS = """ids => Object.fromEntries(ids.map(id => {
  const r = document.getElementById(id).getBoundingClientRect();
  return [id, [r.left, r.top, r.right, r.bottom]];
}))"""
SMALLEST = """() => Math.min(...[...document.querySelectorAll("#play *")]
  .filter(e => e.checkVisibility() && [...e.childNodes].some(n => n.nodeType === 3 && n.textContent.trim()))
  .map(e => parseFloat(getComputedStyle(e).fontSize)))"""
STRUCK = """kind => {
  const row = document.createElement("li"), name = document.createElement("b");
  row.className = kind; row.append(name); document.getElementById("list").append(row);
  const line = getComputedStyle(name).textDecorationLine; row.remove(); return line;
}"""


def shared(a, b):
    """Area that two rectangles (left, top, right, bottom) share, px^2."""
    width, height = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    return max(0.0, width) * max(0.0, height)


def check_shapes(page):
    """Lists leave the view free, buttons the clock, and all text can be read."""
    for name, (width, height) in SHAPES.items():
        page.set_viewport_size({"width": width, "height": height})
        page.wait_for_timeout(500)
        at = page.evaluate(RECTS, ["view", "tasks", "side", "clock", "progress", "room", "tools"])
        view = at["view"]
        covered = sum(shared(view, at[part]) for part in ("tasks", "side"))
        limit = 0.0 if name in ("wide", "phone") else COVERED
        assert covered <= limit * shared(view, view) + 1.0, name
        assert not any(shared(at["tools"], at[part]) for part in ("clock", "progress", "room")), name
        assert page.evaluate(SMALLEST) >= 12.0, name


def test_the_page_of_a_task_in_windows_of_all_shapes(tmp_path, chromium):
    page = chromium.new_page()
    page.set_default_timeout(1000.0 * PATIENCE)
    words = ("--objects", "24", "--assistance", "optimal", "--phases", "task", *FAST)
    with PlayProcess(tmp_path / "visits", *words) as server:
        page.goto(server.begin())
        page.get_by_role("button", name="Start", exact=True).press("Enter")
        page.locator("#list li").first.wait_for(state="attached")
        page.locator("#room:not(:empty)").wait_for()
        check_shapes(page)
        struck = [page.evaluate(STRUCK, kind) for kind in ("", "done", "carried")]
        assert struck == ["none", "line-through", "none"], "only what was delivered is struck through"
        page.set_viewport_size({"width": 1280, "height": 720})
        page.get_by_role("button", name="Full screen").click()
        page.locator("#play:fullscreen, :fullscreen #play").wait_for()


def test_the_text_of_a_choice_does_not_run_under_its_button_on_a_phone(chromium):
    page = chromium.new_page(viewport={"width": 390, "height": 844})
    page.set_content(f"<style>{STYLE.read_text()}</style>{CHOICE.format('many long words ' * 12)}")
    button, text = (page.locator(at).bounding_box() for at in ("input", "span"))
    assert text["x"] >= button["x"] + button["width"]
    assert text["height"] > 2 * button["height"], "it has several lines"
