"""Observed disorder, from which episodes are drawn: how many objects are misplaced, and how far from home they are."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from mjsim.support.files import read_text
from mjsim.values.errors import EpisodeError, brief

_COUNTS, _DISTANCES = 0, 1


class _Count(msgspec.Struct):
    objects: Annotated[int, msgspec.Meta(ge=0)]
    episodes: Annotated[int, msgspec.Meta(ge=1)]


class _DisorderFile(msgspec.Struct):
    misplaced: list[_Count]
    distances: list[Annotated[float, msgspec.Meta(ge=0.0)]]


@dataclass(frozen=True)
class Disorder:
    """Disorder of observed episodes.

    Attributes:
        misplaced: Number of misplaced objects of each episode.
        distances: Walking distances from misplaced objects to where they belong, in metres.
    """

    misplaced: tuple[int, ...]
    distances: tuple[float, ...]

    @classmethod
    def load(cls, path: Path) -> "Disorder":
        """Read a `disorder.json` written by `mjsim import episodes`. Raise an EpisodeError if it cannot be read."""
        try:
            found = msgspec.json.decode(read_text(path), type=_DisorderFile)
        except (OSError, UnicodeDecodeError, msgspec.MsgspecError) as error:
            raise EpisodeError(brief(f"cannot read disorder {path}: {error}")) from error
        counts = tuple(c.objects for c in found.misplaced for _ in range(c.episodes))
        if not any(counts) or not found.distances:
            raise EpisodeError(f"{path} has no misplaced object with a distance; import other episodes")
        return cls(counts, tuple(found.distances))

    def tables(self) -> dict[str, list[dict[str, int]] | list[float]]:
        counts = sorted(Counter(self.misplaced).items())
        return {
            "misplaced": [{"objects": n, "episodes": k} for n, k in counts],
            "distances": sorted(self.distances),
        }

    def count(self, seed: int, most: int) -> int:
        """Draw a number of objects, at most `most`, from the observed numbers."""
        fitting = [n for n in self.misplaced if 1 <= n <= most]
        if not fitting:
            raise EpisodeError(f"no episode has 1 to {most} misplaced objects; allow more")
        return int(np.random.default_rng([seed, _COUNTS]).choice(fitting))

    def assign(self, points: NDArray[np.float64], homes: NDArray[np.float64], seed: int) -> NDArray[np.intp]:
        """Assign points to objects so that their distances from home match distances drawn from the observed ones.

        Args:
            points: Free points (p, 2), in metres.
            homes: Positions where the objects belong (k, 2), in metres, k <= p.
            seed: Seed of the drawn distances.

        Returns:
            A different row of `points` for each object, shape (k,).
        """
        wanted = np.random.default_rng([seed, _DISTANCES]).choice(self.distances, len(homes))
        reached = np.linalg.norm(points - homes[:, None], axis=2)
        return np.asarray(linear_sum_assignment(np.abs(reached - wanted[:, None]))[1])
