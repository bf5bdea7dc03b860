"""Where things are on the page of a task, in windows of all shapes."""

from pathlib import Path

import pytest

import experiments.web
from benchmarks.play import FAST
from benchmarks.support.play_server import PATIENCE, PlayProcess

pytestmark = pytest.mark.slow

STYLE = Path(experiments.web.__file__).parent / "client" / "static" / "style.css"
CHOICE = "<fieldset class=question><label><input type=radio> <span>{}</span></label></fieldset>"
SHAPES = {"wide": (1280, 720), "4:3": (1024, 768), "narrow": (800, 600), "phone": (390, 844)}
# Windows in which parts were cut off, and the least font size and width of the map in each, in px. One is as small as
# a window of 1280 x 720 px at 200 % zoom.
SMALL = {"zoomed": (640, 360), "small": (480, 320), "small, upright": (480, 640)}
SCALED = {"full screen": (1920, 1080, 18.0, 200.0), "zoomed": (640, 360, 12.0, 100.0)}
PHONE_ACROSS = {"viewport": {"width": 844, "height": 390}, "has_touch": True, "is_mobile": True}
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
        resize(page, width, height)
        at = page.evaluate(RECTS, ["view", "tasks", "side", "clock", "progress", "room", "tools"])
        view = at["view"]
        covered = sum(shared(view, at[part]) for part in ("tasks", "side"))
        limit = 0.0 if name in ("wide", "phone") else COVERED
        assert covered <= limit * shared(view, view) + 1.0, name
        assert not any(shared(at["tools"], at[part]) for part in ("clock", "progress", "room")), name
        assert page.evaluate(SMALLEST) >= 12.0, name


def resize(page, width, height):
    """Resize the window, and wait until the page has its layout, which takes seconds while a busy machine draws."""
    page.set_viewport_size({"width": width, "height": height})
    page.wait_for_function("size => innerWidth === size[0] && innerHeight === size[1]", arg=[width, height])
    page.wait_for_timeout(500)
    page.evaluate("() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)))")


def within(page, selector):
    """True if each visible match is as wide and high as its content, and inside the window."""
    return page.evaluate(
        """selector => [...document.querySelectorAll(selector)].filter((e) => e.checkVisibility()).every((e) => {
            const r = e.getBoundingClientRect();
            return r.left >= 0 && r.top >= 0 && r.right <= innerWidth + 0.5 && r.bottom <= innerHeight + 0.5
                && e.scrollWidth <= e.clientWidth + 1;
        })""",
        selector,
    )


def label_at(page, x):
    """Left and right edges of the label of what is in reach, and of the view, for a share of the view's width."""
    return page.evaluate(
        """([x, key, what]) => {
            const label = document.getElementById("reach"), view = document.getElementById("view");
            label.hidden = false;
            label.replaceChildren(key, " ", what);
            label.style.setProperty("--x", x);
            const [a, b] = [label, view].map((e) => e.getBoundingClientRect());
            label.hidden = true;
            return [a.left, a.right, b.left, b.right];
        }""",
        [x, "E", "Put Turquoise T-shirt into Laundry hamper"],
    )


def check_sizes(page):
    """Nothing is cut off in small windows, and text and map grow with the window."""
    for name, (width, height) in SMALL.items():
        resize(page, width, height)
        page.evaluate(
            "document.getElementById('redraw-button').hidden = false"
        )  # as after a change of drawing
        assert within(page, "#tools button, #map, #hands li"), name
        for x in (0.0, 0.1, 0.5, 1.0):
            left, right, view_left, view_right = label_at(page, x)
            assert view_left <= left + 0.5 and right <= view_right + 0.5, (name, x)
    for name, (width, height, font, least) in SCALED.items():
        resize(page, width, height)
        size = page.evaluate("parseFloat(getComputedStyle(document.getElementById('list')).fontSize)")
        left, _, right, _ = page.evaluate(RECTS, ["map"])["map"]
        assert font <= size <= 20.0 and right - left >= least, name


def check_hands(page):
    """The list below the hands stays where it is when a hand fills."""
    tops = page.evaluate(
        """() => {
            const hands = document.querySelectorAll("#hands li"), bins = document.getElementById("bins");
            const before = bins.getBoundingClientRect().top;
            const image = new Image();
            for (const hand of hands) {
                hand.querySelector("b").textContent = "Turquoise T-shirt with long sleeves";
                hand.prepend(image.cloneNode());
            }
            return [before, bins.getBoundingClientRect().top];
        }"""
    )
    assert tops[0] == tops[1]


def test_buttons_of_a_phone_held_across_cover_no_list(tmp_path, chromium):
    page = chromium.new_context(**PHONE_ACROSS).new_page()
    page.set_default_timeout(1000.0 * PATIENCE)
    words = ("--objects", "6", "--assistance", "optimal-minimap", "--phases", "task", *FAST)
    with PlayProcess(tmp_path / "visits", *words) as server:
        page.goto(server.begin())
        page.get_by_role("button", name="Start", exact=True).press("Enter")
        page.locator("#list li").first.wait_for(state="attached")
        page.locator("#map:not([hidden])").wait_for()
        buttons = page.evaluate(
            """() => [...document.querySelectorAll("#touch button")].map((button) => {
                const r = button.getBoundingClientRect();
                return [r.left, r.top, r.right, r.bottom];
            })"""
        )
        at = page.evaluate(RECTS, ["list", "hands", "bins", "map"])
        assert not any(shared(place, button) for place in at.values() for button in buttons)
        assert all(right - left >= 100.0 and bottom - top >= 20.0 for left, top, right, bottom in at.values())
        assert all(bottom <= 390.5 for _, _, _, bottom in at.values())
        assert within(page, "#tools button, #touch button, #hands li")


def test_the_page_of_a_task_in_windows_of_all_shapes(tmp_path, chromium):
    page = chromium.new_page()
    page.set_default_timeout(1000.0 * PATIENCE)
    words = ("--objects", "24", "--assistance", "optimal-minimap", "--phases", "task", *FAST)
    with PlayProcess(tmp_path / "visits", *words) as server:
        page.goto(server.begin())
        page.get_by_role("button", name="Start", exact=True).press("Enter")
        page.locator("#list li").first.wait_for(state="attached")
        page.locator("#room:not(:empty)").wait_for()
        check_shapes(page)
        check_sizes(page)
        check_hands(page)
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
