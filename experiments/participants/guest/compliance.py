"""Whether a person does what the assistant suggests."""

from dataclasses import dataclass

import numpy as np

from experiments.participants.behaviour import chance, varies


@dataclass(frozen=True)
class Compliance:
    """How closely a person follows a suggested step.

    The published variance of deviations is largest under `optimal` at every difficulty, as if there were kinds of
    people (PAPER section 8): some always follow, some sometimes, some hardly. The weights are starting values. A person
    who always follows neither gives up a step nor picks up anything else, but may quit as well.
    """

    # probability of taking up a suggested step
    follows: float = chance({"mixture": [[0.62, 1.0], [0.20, {"beta": [2, 2]}], [0.18, {"beta": [1, 9]}]]})
    abandons: float = chance({"beta": [1.0, 19.0]})  # probability of giving up a step on the way to it
    # probability of picking up an object that is noticed next to the path, with a hand free
    picks_up: float = chance({"uniform": [0.15, 0.30]})
    beside: float = varies(2.0, 0.0, 20.0, "m")  # largest distance of such an object from the person, m
    # probability, at each suggestion, of following none from then on
    quits: float = chance({"beta": [1.0, 99.0]})


class Adherence:
    """A person's decisions about suggestions."""

    def __init__(self, compliance: Compliance, rng: np.random.Generator) -> None:
        self.compliance, self._rng, self._has_quit = compliance, rng, False

    def takes_up(self) -> bool:
        """Whether a suggested step is followed."""
        quits, follows = self._rng.random(2).tolist()
        self._has_quit |= quits < self.compliance.quits
        return follows < self.compliance.follows and not self._has_quit

    def gives_up_after(self, duration: float) -> float | None:
        """Time after which the step is given up, s, on a walk of this duration, s; None if it is not."""
        chance, share = self._rng.random(2).tolist()
        gives_up = chance < self.compliance.abandons and not self._always_follows
        return share * duration if gives_up else None

    def picks_up(self, distance: float) -> bool:
        """Whether an object noticed at a distance, m, is picked up in passing."""
        tempted = float(self._rng.random()) < self.compliance.picks_up
        return tempted and distance <= self.compliance.beside and not self._always_follows

    @property
    def _always_follows(self) -> bool:
        return self.compliance.follows >= 1.0
