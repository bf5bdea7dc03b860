"""A participant who double-clicks everything, goes back and reloads every page of a study, gets to its end."""

import os
import sqlite3
import time
from contextlib import closing

import pytest

from benchmarks.support.play_server import PlayProcess
from tests.experiments.web.browser.key_presser import WATCH
from tests.experiments.web.browser.study_visit import STUDY, StudyVisit

pytestmark = [pytest.mark.slow, pytest.mark.long]


# Firefox draws so slowly without a graphics card that it takes minutes.
BROWSERS = ["chromium", "firefox"] if "MJSIM_ALL_CONDITIONS" in os.environ else ["chromium"]
BACK = 0.5  # time after which the browser has left the page, in seconds
TWICE = """(() => {
    const button = document.querySelector("#play") ? null : document.querySelector("form .button");
    button?.click();
    button?.click();
    return Boolean(button);
})()"""


class Impatient:
    """A page on which a form is sent twice, as by a double click before the next page appears."""

    def __init__(self, page):
        self._page = page

    def __getattr__(self, name):
        return getattr(self._page, name)

    def click(self, selector):
        if selector != "form .button" or not self._page.evaluate(TWICE):
            self._page.click(selector)

    def hold(self, key, seconds=0.05):
        if key != "Enter" or not self._page.evaluate(TWICE):
            self._page.hold(key, seconds)


class ImpatientVisit(StudyVisit):
    """A visit in which every page is left by Back and reloaded before it is used."""

    def __init__(self, page, folder):
        super().__init__(Impatient(page), folder)

    def _heading(self, text):
        super()._heading(text)
        link = self._page.evaluate("location.href")
        self._page.evaluate("history.back()")
        time.sleep(BACK)
        self._page.wait_for("document.readyState === 'complete'")
        self._page.goto(link)
        super()._heading(text)
        self._page.reload()
        super()._heading(text)


@pytest.mark.parametrize("browser", BROWSERS)
def test_double_clicks_back_and_reload_on_every_page_do_no_harm(tmp_path, request, browser):
    page = request.getfixturevalue(f"{browser}_page")
    (tmp_path / "study.toml").write_text(STUDY)
    command = ("study", "serve", str(tmp_path / "study.toml"))
    with PlayProcess(tmp_path / "out", command=command) as server:
        page.prepare(WATCH)
        page.goto(server.url)
        ImpatientVisit(page, tmp_path / "out").go_to_the_end()
    with closing(sqlite3.connect(tmp_path / "out" / "study.db")) as database:
        ended = database.execute("SELECT status FROM person").fetchall()
        done = dict(database.execute("SELECT name, ended IS NOT NULL FROM phase"))
        attempts = database.execute(
            "SELECT value FROM answer WHERE phase = 'comprehension' AND item = 'attempts'"
        ).fetchall()
    assert ended == [("finished",)]
    assert all(
        done[name] for name in ("consent", "device", "story", "comprehension", "training", "task", "survey")
    )
    assert attempts == [], "the first form was accepted, although it was sent twice"
