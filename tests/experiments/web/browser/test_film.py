"""The film of a session that a browser drew shows what the person's window showed."""

import time

import av
import numpy as np
import pytest

from benchmarks.play import FAST
from benchmarks.support.play_server import PlayProcess
from experiments.record.reader import read_run
from experiments.trials.replay.replay import ReplayFilm, as_seen, replay
from tests.experiments.web.browser.key_presser import choose
from tests.experiments.web.browser.pages import pass_story
from tools.drawn_pairs import decoded, ssim

pytestmark = [pytest.mark.slow, pytest.mark.long]

LEAST = 0.95  # SSIM, as of the pairs of pictures
STILL = 6.0  # s after which messages have faded, and the page has told its size


@pytest.mark.parametrize(
    ("width", "height", "degrees"),
    [(800, 600, None), (1280, 720, 105)],
)
def test_the_film_shows_what_the_window_showed(tmp_path, chromium_page, width, height, degrees):
    page = chromium_page
    page.resize(width, height)
    options = ["--objects", "6", "--assistance", "optimal", *FAST]
    if degrees:
        options += ["--field-of-view-range", "1.0,2.0"]
    with PlayProcess(tmp_path / "visits", *options) as server:
        page.goto(server.url)
        pass_story(page)
        page.wait_for("document.querySelector('[data-trial]')")
        address = page.evaluate("location.href")
        page.goto(f"{address}?draw=browser")
        choose(page, "Skip the training")
        choose(page, "Start")
        page.wait_for("document.querySelectorAll('#list li').length > 0")
        if degrees:
            page.evaluate(
                f"const slider = document.querySelector('[name=degrees]'); slider.value = {degrees};"
                " slider.dispatchEvent(new Event('change'))"
            )
        time.sleep(STILL)  # where the episode begins, so that every run of this test compares the same
        seen = decoded(page.picture("#world"))
        page.hold("p")
        page.wait_for("document.getElementById('panel-title').textContent === 'Paused'")
        page.evaluate("document.getElementById('end-button').click()")
        choose(page, "End this part")
        page.wait_for("document.querySelector('h1').textContent === 'Your result'")
        run = server.visit(address) / "task"
    film = tmp_path / "film.mp4"
    replay(run, film=ReplayFilm(film, None))
    config = as_seen(read_run(run), "fast")
    assert config.field_of_view == (degrees and pytest.approx(np.deg2rad(degrees)))
    left, top, width, height = config.view
    assert seen.shape == (height, width, 3), "the film has the shape of the view"
    with av.open(str(film)) as video:
        *_, last = video.decode(video=0)
    frame = last.to_ndarray(format="rgb24")[top : top + height, left : left + width]
    np.savez(tmp_path / "pictures.npz", seen=seen, frame=frame)  # to be looked at
    assert ssim(seen, frame) >= LEAST
