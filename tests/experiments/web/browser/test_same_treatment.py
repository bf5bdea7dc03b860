"""What the page of a person says is what a film says: the same words from the same state, under every condition."""

import dataclasses
import functools
import http.server
import itertools
import json
import re
import threading

import hud_sample as sample
import msgspec
import numpy as np
import pytest
from jinja2 import Environment, FileSystemLoader

from experiments.house import read_words
from experiments.web.client_files import CLIENT, STATIC, trial_texts
from experiments.web.worker.viewer import page_hud
from hud import stencils
from hud.compose import compose
from hud.conditions import condition
from hud.messages import message

pytestmark = pytest.mark.slow

CONDITIONS = ("none", "highlight", "optimal", "guided", "highlight-regret", "optimal-bins")
# What only one of them writes around the content: words for counts, titles, and what only screen readers say.
PAGE_ALONE = {
    "en": {"put", "away", "left", "in", "your", "hand", "done", "·", "✓", "i", "→"},
    "de": {"weggeräumt", "linke", "in", "ihrer", "hand", "erledigt", "·", "✓", "i", "→"},
}
FILM_ALONE = {"•", "→", "·", "/"}
PAGE = """<!doctype html><meta charset="utf-8"><title>HUD</title>
<main id="play"><p id="progress"></p><p id="clock"></p><p id="room"></p>
{tasks}<div id="view"><button id="reach"></button><div id="pointer"></div><p id="message"></p></div>{side}</main>"""
SHOW = """async (state) => {
    const { Hud } = await import("/hud.js");
    const hud = new Hud(() => "E");
    hud.show(state);
    const moment = { type: "moment", step: 0, clock: state.clock, room: "", reach: null, pointer: null, minimap: null };
    hud.showMoment(moment);
    const rows = (id) => [...document.querySelectorAll(`#${id} li`)];
    return {
        parts: [...document.querySelectorAll("#play :is(b, small, i, p, h2)")].map((part) => part.textContent),
        tasks: rows("list").map((row) => row.querySelector("b").textContent),
        done: rows("list").map((row) => row.className === "done" || row.className === "carried"),
        current: rows("list").map((row) => row.hasAttribute("aria-current")),
    };
}"""


@pytest.fixture(params=["en", "de"])
def language(request):
    return request.param


@pytest.fixture
def page(chromium, language):
    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    serving = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=STATIC))
    threading.Thread(target=serving.serve_forever, daemon=True).start()
    page = chromium.new_page()
    parts = (
        Environment(loader=FileSystemLoader(CLIENT / "templates"), autoescape=True)
        .get_template("hud.html")
        .module
    )
    texts = trial_texts(read_words(language))
    content = PAGE.format(tasks=parts.tasks(), side=parts.side(texts))
    content += f'<script type="application/json" id="texts">{json.dumps(texts)}</script>'
    address = f"http://127.0.0.1:{serving.server_port}/"
    page.route(address, lambda route: route.fulfill(body=content, content_type="text/html"))
    page.goto(address)
    yield page
    serving.shutdown()


@pytest.fixture
def drawn(monkeypatch):
    """Every text that the film draws."""
    texts = []
    draw = stencils.Stencils._text
    monkeypatch.setattr(
        stencils.Stencils, "_text", lambda self, text, face: texts.append(text) or draw(self, text, face)
    )
    return texts


def words(texts):
    return set(re.findall(r"[^\s,:/()]+", " ".join(texts).lower()))


def test_page_and_film_say_the_same(page, drawn, language):
    texts = sample.texts(language)
    for name, steps in itertools.product(CONDITIONS, (0, 3)):
        drawn.clear()
        bar = message("picked", texts, object="Blue mug", receptacle="Dish bin")
        view = dataclasses.replace(sample.task(4, steps=steps, message=bar), texts=texts)
        state = condition(name)(view)
        compose(np.zeros((1080, 1920, 3), np.uint8), state, sample.pictures(), texts)
        shown = page.evaluate(SHOW, msgspec.to_builtins(page_hud(state).state) | {"clock": state.clock})
        film, on_page = words(drawn), words(shown["parts"])
        assert on_page - film <= PAGE_ALONE[language], name
        assert film - on_page <= FILM_ALONE, name
        assert shown["tasks"] == [item.text for item in state.checklist]
        assert shown["done"] == [item.done for item in state.checklist]
        assert shown["current"] == [item.current for item in state.checklist]
        assert len(film) > 20
