"""Somebody who goes through a study by keys and clicks alone, in any browser, in a frame or not."""

import json

import msgspec

from experiments.house import House
from experiments.record import records
from experiments.trials.replay.replay import replay
from experiments.trials.setup import trial_episode
from experiments.trials.trial_config import TrialConfig
from tests.experiments.web.browser.key_presser import KeyPresser, choose

STUDY = """
[[cells]]
assistance = "optimal"
objects = 1
people = 4
house_seeds = 0
fidelity = "event"

[study]
name = "small"
title = "A small study"
institution = "a test"
contact = "nobody@example.org"
phases = ["consent", "device", "story", "comprehension", "training", "task", "survey", "debriefing", "completion"]

[study.pay]
reward = 7.50
bonus_for_all = 1.00

[study.device]
frames_per_s = 0
latency_ms = 100000
width = 300
height = 300
"""
SCALES = 17


class StudyVisit:
    """A person at the first page of a study.

    Args:
        page: Shows it, with `WATCH` prepared.
        folder: Of the study.
    """

    def __init__(self, page, folder):
        self._page, self._folder = page, folder

    def go_to_the_end(self):
        """Agree, pass the checks, play, answer, and come to the last page."""
        self._heading("A small study")
        self._page.click("form .button")
        self._agree()
        self._check_device()
        self._heading("Your task")
        self._page.click("form .button")
        self._answer_questions()
        self._play()
        self._answer_survey()
        self._heading("About this study")
        self._page.click("form .button")
        self._heading("Thank you")

    def check_record(self):
        """What was played is whole."""
        run = self._visit / "task"
        assert msgspec.json.decode((run / records.METRICS).read_bytes())["delivered"] == 1
        assert all(verdict.verified for verdict in replay(run).verdicts)

    @property
    def _visit(self):
        (visit,) = (self._folder / "visits").iterdir()
        return visit

    def _heading(self, text):
        self._page.wait_for(f"document.querySelector('h1')?.textContent === {json.dumps(text)}")

    def _focus_is_on(self, what):
        self._page.wait_for(f"document.activeElement?.matches({json.dumps(what)})")

    def _agree(self):
        self._heading("Your consent")
        self._page.click("[type=checkbox]")
        self._focus_is_on("[type=checkbox]")
        self._page.hold("Enter")

    def _check_device(self):
        self._heading("Your computer")
        self._page.wait_for("document.querySelector('#state')?.textContent.includes('Press the W')")
        if not self._page.evaluate("document.hasFocus()"):
            self._page.click("h1")
        self._page.hold("w")
        self._focus_is_on(".button")
        self._page.hold("Enter")

    def _answer_questions(self):
        self._page.wait_for("document.querySelectorAll('fieldset').length === 3")
        for name, answer in (("goal", 0), ("hands", 1), ("speed", 1)):
            self._page.click(f"#item-{name} label input")
            for _ in range(answer):
                self._page.hold("ArrowDown")
        self._page.hold("Enter")

    def _play(self):
        house = House.load()
        self._page.wait_for("document.querySelector('#play')?.dataset.trial === 'training'")
        self._page.evaluate("{ location.search = '?draw=browser'; }")
        self._page.wait_for("location.search === '?draw=browser' && document.querySelector('#play')")
        settings = msgspec.json.decode((self._visit / "visit.json").read_bytes())["trials"]
        for trial, label in (("training", "Start the training"), ("task", "Start")):
            self._page.wait_for(f"document.querySelector('#play')?.dataset.trial === '{trial}'")
            choose(self._page, label)
            self._page.wait_for("document.querySelectorAll('#list li').length > 0")
            self._look_by_mouse()
            episode = trial_episode(TrialConfig.of(settings[trial]), house)
            KeyPresser(self._page, house, episode).tidy()

    def _look_by_mouse(self):
        """A click captures the mouse, which Escape would release; keys go on working."""
        self._page.click("#screen")
        self._page.wait_for("document.pointerLockElement?.id === 'screen'")

    def _answer_survey(self):
        self._page.wait_for(f"document.querySelectorAll('fieldset.scale').length === {SCALES}")
        names = "[...document.querySelectorAll('fieldset.scale')].map((scale) => scale.id).join(' ')"
        for name in self._page.evaluate(names).split():
            self._page.click(f"#{name} label:nth-of-type(4) input")
        self._page.hold("Enter")
