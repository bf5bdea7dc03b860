"""Somebody who puts objects away by keys alone, in any browser."""

import json
import math
import time

import numpy as np

NEAR = 0.7  # share of the reach from which a pick is tried
IN_A_BIN = 0.5  # m from its middle
ARRIVED = 0.1  # m from a place to stand
CLOSE = 0.2  # m from a corner of the way from which one looks at the next one
ALIGNED, ASTRAY = 0.12, 0.5  # rad off the way from which one turns, and stands to turn
LOOK_EVERY = 0.04  # s
SETTLED = 30.0  # s within which a few simulated seconds pass
TIME_LIMIT = 200.0  # s for each object

# Keeps the states that a page gets which draws.
WATCH = """
    window.watched = { snapshot: null, objects: {} };
    window.WebSocket = class extends WebSocket {
        constructor(...words) {
            super(...words);
            this.addEventListener("message", ({ data }) => {
                if (typeof data !== "string" || !data.startsWith('{"type":"snapshot"')) return;
                watched.snapshot = JSON.parse(data);
                Object.assign(watched.objects, watched.snapshot.objects);
            });
        }
    };
"""
LOOK = """JSON.stringify({
    ...(window.watched ?? {}),
    phase: document.querySelector("#play")?.dataset.phase ?? "",
    trial: document.querySelector("#play")?.dataset.trial ?? "",
})"""


def choose(browser, label):
    """Press a button of a dialog, reached by the keyboard."""
    buttons = "[...document.querySelectorAll('dialog[open] button')].filter((b) => b.checkVisibility())"
    browser.wait_for(f"{buttons}.some((button) => button.textContent === {json.dumps(label)})")
    while browser.evaluate("document.activeElement?.textContent ?? ''") != label:
        browser.hold("Tab")
    browser.hold("Enter")


class KeyPresser:
    """Puts the objects of a task away: the nearest one first, then those in the hands.

    Args:
        browser: Shows a visit, with `WATCH` prepared.
        house: Where the person is.
        episode: What is to be put away.
    """

    def __init__(self, browser, house, episode):
        self._browser, self._house = browser, house
        self._targets = episode.targets
        self._places = {placed.name: placed.position for placed in episode.objects}
        self._seen, self._forward = {}, False

    def tidy(self):
        """Play until another page is shown."""
        until, trial = time.monotonic() + TIME_LIMIT * len(self._targets), self._look()["trial"]
        while self._look()["trial"] == trial:
            assert time.monotonic() < until, "the task was not done in time"
            if self._playing:
                self._visit()
            else:
                time.sleep(0.1)

    def _look(self):
        seen = json.loads(self._browser.evaluate(LOOK))
        self._places |= seen.get("objects") or {}
        self._seen = {**seen, "snapshot": seen.get("snapshot") or self._seen.get("snapshot")}
        return self._seen

    @property
    def _playing(self):
        """Whether the clock runs; it does not on the next page, which may be there before one looks again."""
        return self._seen["phase"] == "running" and self._state is not None

    @property
    def _state(self):
        return self._seen["snapshot"]

    @property
    def _position(self):
        return np.array(self._state["eye"][:2])

    def _visit(self):
        """Walk on to the next object or bin, or press the key there."""
        held = [name for name in self._state["held"] if name]
        loose = [name for name in self._targets if name not in held and not self._is_away(name)]
        if held and (len(held) == 2 or not loose):
            keys = [self._targets[name] for name in held]
            key = min(keys, key=lambda key: self._way(self._house.approaches[key])[1])
            self._approach(self._house.receptacles[key].center[:2], self._house.approaches[key], ARRIVED)
        elif loose:
            place = min((self._place(name) for name in loose), key=lambda place: self._way(place)[1])
            self._approach(place, place, NEAR * self._house.person.reach)
        else:
            self._wait(0.1)

    def _place(self, name):
        """Where an object was seen last."""
        return np.array(self._places[name][:2])

    def _is_away(self, name):
        """Whether an object lies in its bin."""
        center = self._house.receptacles[self._targets[name]].center[:2]
        return math.dist(self._place(name), center) < IN_A_BIN

    def _approach(self, goal, stand, near):
        """Walk to a place, as straight as one can, and press the key in front of a goal."""
        while self._playing and (left := self._way(stand))[1] > near:
            corners = [*left[0], stand]
            self._walk_to(
                next((place for place in corners if math.dist(place, self._position) > CLOSE), stand)
            )
        self._hold_forward(False)
        self._wait(0.15)
        self._turn_to(goal)
        self._browser.hold("e")
        self._wait(0.25)
        self._wait(3.0, lambda: self._state["busy"])

    def _walk_to(self, place):
        """Turn towards a place, and walk for a moment."""
        if abs(angle := self._off(place)) > ALIGNED:
            if abs(angle) > ASTRAY:
                self._hold_forward(False)
            self._turn(angle)
        self._hold_forward(True)
        self._wait(0.1)

    def _hold_forward(self, forward):
        if forward is not self._forward:
            (self._browser.down if forward else self._browser.up)("w")
        self._forward = forward

    def _way(self, place):
        """The shortest way to a place: its corners, and its length, m."""
        found = self._house.geodesics.shortest_path(self._position, place)
        return found.points, found.geodesic_distance

    def _off(self, target):
        """Angle from where one looks to a place, rad."""
        ahead = target - self._position
        angle = math.atan2(ahead[1], ahead[0]) - self._state["eye"][3]
        return (angle + math.pi) % (2.0 * math.pi) - math.pi

    def _turn_to(self, target):
        for _ in range(6):
            if not self._playing or abs(angle := self._off(target)) < ALIGNED:
                return
            self._turn(angle)

    def _turn(self, angle):
        key = "ArrowLeft" if angle > 0 else "ArrowRight"
        self._browser.hold(key, abs(angle) / self._house.person.turning_speed)
        self._wait(0.2)

    def _wait(self, seconds, holds=lambda: True):
        """Wait until so much has been simulated, the clock stands, or something no longer holds."""
        before, until = self._state["time"], time.monotonic() + SETTLED
        while self._look() and self._playing and self._state["time"] < before + seconds and holds():
            assert time.monotonic() < until, "the session stands still"
            time.sleep(LOOK_EVERY)
