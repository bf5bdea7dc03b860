"""Code of a user's own, as modules that the tests write."""


def participant(statement, after=0):
    """A module with a participant that walks in circles; after so many control steps it does something else."""
    return f"""
import os, signal, time
from mjsim.actions import Move, Pick, Place
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
