"""Code of a user's own that misbehaves, as text of modules."""


def participant(statement: str, after: int = 0) -> str:
    """A module with a participant that walks in circles; after so many control steps it does something else."""
    return f"""
import os, signal, sys, time
from mjsim.values.actions import FollowPath, Move, Pick, Place, Wait
class Own:
    needs = frozenset()
    count = 0
    def act(self, percept):
        self.count += 1
        if self.count > {after}:
            {statement}
        return Move(forward=0.5, turn=0.3)
def build(house, rng):
    return Own()
"""


def planner(statement: str, after: int = 0) -> str:
    """A module with a planner that goes to the nearest first; after so many plans it does something else."""
    return f"""
import os, signal, sys, time
from dataclasses import replace
from planner.greedy_solver import GreedySolver
from planner.plan import Plan, Status
class Own:
    count = 0
    def solve(self, problem, *, seed=0, limit=None):
        plan, self.count = GreedySolver().solve(problem), self.count + 1
        if self.count > {after}:
            {statement}
        return plan
"""


def condition(statement: str, after: int = 0) -> str:
    """A module with a condition that shows what `none` shows; after so many calls it does something else."""
    return f"""
import os, sys, time
from dataclasses import replace
import numpy as np
from hud.builtin_conditions import none as shown
from hud.state import Marker, Message, MessageKind
count = 0
def hud_state(view):
    global count
    count, state = count + 1, shown(view)
    if count > {after}:
        {statement}
    return state
"""
