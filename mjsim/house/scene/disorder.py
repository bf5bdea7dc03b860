"""Statistics of misplaced objects in observed episodes, from which new episodes can be sampled."""

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
    """Statistics of the misplaced objects in a set of observed episodes.

    Attributes:
        misplaced: Number of misplaced objects in each episode.
        distances: Horizontal distances between misplaced objects and the places where they belong, in metres.
    """

    misplaced: tuple[int, ...]
    distances: tuple[float, ...]

    @classmethod
    def load(cls, path: Path) -> "Disorder":
        """Load a `disorder.json` file of `mjsim import episodes`. Raise an EpisodeError if this fails."""
        try:
            found = msgspec.json.decode(read_text(path), type=_DisorderFile)
        except (OSError, UnicodeDecodeError, msgspec.MsgspecError) as error:
            raise EpisodeError(brief(f"cannot read disorder {path}: {error}")) from error
        counts = tuple(c.objects for c in found.misplaced for _ in range(c.episodes))
        if not any(counts) or not found.distances:
            raise EpisodeError(f"{path} has no misplaced object with a distance; import other episodes")
        return cls(counts, tuple(found.distances))

    def tables(self) -> dict[str, list[dict[str, int]] | list[float]]:
        """Return the content of the TOML tables that `mjsim house import` writes."""
        counts = sorted(Counter(self.misplaced).items())
        return {
            "misplaced": [{"objects": n, "episodes": k} for n, k in counts],
            "distances": sorted(self.distances),
        }

    def count(self, seed: int, most: int) -> int:
        """Draw a random number of misplaced objects, from 1 to `most`, from the observed episodes."""
        fitting = [n for n in self.misplaced if 1 <= n <= most]
        if not fitting:
            raise EpisodeError(f"no episode has 1 to {most} misplaced objects; allow more")
        return int(np.random.default_rng([seed, _COUNTS]).choice(fitting))

    def assign(self, points: NDArray[np.float64], homes: NDArray[np.float64], seed: int) -> NDArray[np.intp]:
        """Choose a point for each object so that the distances to the homes resemble observed distances.

        Args:
            points: Points to choose from, in metres, shape (p, 2).
            homes: Positions where the objects belong, in metres, shape (k, 2) with k <= p.
            seed: Seed with which the distances are drawn.

        Returns:
            The row of `points` that was chosen for each object, shape (k,). No row is chosen twice.
        """
        wanted = np.random.default_rng([seed, _DISTANCES]).choice(self.distances, len(homes))
        reached = np.linalg.norm(points - homes[:, None], axis=2)
        return np.asarray(linear_sum_assignment(np.abs(reached - wanted[:, None]))[1])
