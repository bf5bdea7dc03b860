"""Percepts that are written by hand, so that every branch of a participant can be reached."""

import math
from types import SimpleNamespace

import numpy as np

from mjsim.values.actions import IDLE, FollowPath, Pick
from mjsim.values.person_parameters import PersonParameters


class Script:
    """A participant and the percept that changes from one decision to the next."""

    def __init__(self, participant, targets, position):
        self.participant = participant
        self.percept = SimpleNamespace(
            **{"time": 0.0, "position": np.array(position), "heading": 0.0, "pitch": 0.0, "busy": False},
            **{"carried": (), "targets": targets, "answer": None, "blocked": False, "nearby": {}},
            **{"person": PersonParameters(), "shown_roles": frozenset(), "guidance": None, "flagpoles": {}},
        )

    def act(self, seen=(), seconds=1.0, **changes):
        """Return the action after some seconds. `seen` contains the objects in view and their positions."""
        now, seen = self.percept, dict(seen)
        now.answer = None
        vars(now).update(changes)
        now.time += seconds
        now.hands_full, now.look = len(now.carried) >= 2, lambda: seen
        now.visible_shares = dict.fromkeys(seen, 1.0)
        return self.participant.act(now)

    def aim(self, *args, **changes):
        """Return what follows the walk, such as Pick("cup"), or `search`, or `none`. Return other actions."""
        action = self.act(*args, **changes)
        if not isinstance(action, FollowPath):
            return "none" if action == IDLE else action
        return action.then or "search"

    def turn(self):
        """Return the actions during a turn of a bit more than a full circle, and the one after it."""
        return [self.act(heading=angle % math.tau) for angle in np.arange(0.0, math.tau + 0.5, 0.5)]


def place_in(house, room, number=0):
    return np.array(house.viewpoints[room][number])


def place_near(house, point, distance):
    """Return a walkable point at a distance from another one, to a few centimetres."""
    points = house.navmesh.sample(np.random.default_rng(0), 5000)
    return points[np.abs(np.linalg.norm(points - point, axis=1) - distance).argmin()]


def refusal(name):
    return SimpleNamespace(applied=False, object=name, action=Pick(name))
