"""The published statistics, which are stored in studies/published.toml."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import msgspec
from scipy.stats import f

from experiments.analysis.statistics.effects import ALPHA, FTest, Interval, partial_eta_squared
from mjsim.support.toml import read_toml

FILE = Path(__file__).with_name("published.toml")
NOT_SIGNIFICANT = "n.s."


class PublishedTest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An F test as printed in the paper.

    Attributes:
        measure: Short name of the measure.
        effect: The tested effect.
        df: Degrees of freedom of the effect and of the error.
        p: The p value as printed, such as `=.523` or `n.s.`, or None if there is none.
        objects: Number of objects, or None for a test over all numbers.
        statistic: The F value, or None if it is not printed.
        p_fits: False if the printed p value is known to contradict F.
    """

    measure: str
    effect: Literal["assistance", "objects", "interaction"]
    df: tuple[int, int]
    p: str | None = None
    objects: int | None = None
    statistic: float | None = msgspec.field(default=None, name="F")
    p_fits: bool = True

    @property
    def fitted(self) -> bool:
        """True if the model may be fitted to this test. Tests over all numbers of objects are excluded."""
        return self.objects is not None

    @property
    def significant(self) -> bool:
        """True if the test is significant at .05 by its printed p value or, without one, by F."""
        if self.p is None:
            return float(f.sf(self.statistic, *self.df)) < ALPHA
        return self.p != NOT_SIGNIFICANT and float(self.p[1:]) < ALPHA

    def test(self, people: int) -> FTest | None:
        """Return the test with its effect size, or None if F is not printed."""
        return None if self.statistic is None else FTest(self.statistic, *self.df, people)

    def interval(self, people: int) -> Interval | None:
        """Return the 90 % interval of partial eta squared, or all nonsignificant values if F is unknown."""
        test = self.test(people)
        if test is not None:
            return test.interval
        return 0.0, partial_eta_squared(float(f.ppf(1.0 - ALPHA, *self.df)), *self.df)

    def inconsistency(self) -> str | None:
        """Describe how the printed F and p values contradict each other. Return None if they agree."""
        if self.statistic is None:
            return None
        implied = float(f.sf(self.statistic, *self.df))
        test = f"F({self.df[0]},{self.df[1]}) = {self.statistic:g}"
        if not self.p_fits:
            return f"the printed p does not go with {test}, which gives p = {_short(implied)}"
        if self.p is None:
            return None
        places = len(self.p.partition(".")[2])
        half = 0.5 * 10.0**-places * (1 + 1e-9)
        if abs(implied - float(self.p[1:])) <= half:
            return None
        return f"printed p {self.p}, but {test} gives p = {_short(implied)}"


def _short(p: float) -> str:
    return f"{p:.4f}".lstrip("0") if p >= 1e-4 else f"{p:.1e}"


class Direction(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A published order of means, given by exactly one of `pair`, `same`, `rising`, `lowest` and `falling`.

    Attributes:
        measure: Short name of the measure.
        objects: Number of objects, or None for all numbers.
        pair: Two conditions, of which the first has the smaller mean by Tukey's test.
        p: The p value of that test, as printed.
        same: Two conditions between which Tukey's test finds no difference.
        rising: The condition whose means rise with the number of objects.
        lowest: The condition with the lowest mean at every number of objects.
        falling: Conditions by their means over all numbers of objects, the largest first.
    """

    measure: str
    objects: int | None = None
    pair: tuple[str, str] | None = None
    p: str | None = None
    same: tuple[str, str] | None = None
    rising: str | None = None
    lowest: str | None = None
    falling: tuple[str, ...] | None = None

    def label(self) -> str:
        """Describe the order in words or symbols."""
        if self.pair is not None:
            return " < ".join(self.pair)
        if self.same is not None:
            return " ~ ".join(self.same)
        if self.rising is not None:
            return f"rises with objects under {self.rising}"
        return f"{self.lowest} lowest" if self.lowest is not None else " > ".join(self.falling or ())


class Variances(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The condition in which a measure has the largest variance, at every number of objects."""

    measure: str
    largest: str


class People(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Numbers of participants by condition, for each number of objects."""

    objects: tuple[int, ...]
    none: tuple[int, ...]
    highlight: tuple[int, ...]
    optimal: tuple[int, ...]

    def sizes(self) -> dict[tuple[str, int], int]:
        """Return the number of participants by condition and number of objects."""
        rows = {"none": self.none, "highlight": self.highlight, "optimal": self.optimal}
        return {(c, n): k for c, counts in rows.items() for n, k in zip(self.objects, counts, strict=True)}


class Published(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """All published results with which a study is compared."""

    people: People
    tests: tuple[PublishedTest, ...]
    directions: tuple[Direction, ...]
    variances: Variances

    def people_of(self, objects: int | None) -> int:
        """Return how many people participated with a number of objects, or in total if `objects` is None."""
        return sum(k for (_, n), k in self.people.sizes().items() if objects in (None, n))


def read_published(path: Path = FILE) -> Published:
    """Load the published results from a TOML file."""
    return msgspec.convert(read_toml(path), Published)


def inconsistencies(published: Published) -> Sequence[str]:
    """Return a line about each contradiction between published numbers."""
    return [
        f"{t.measure}, {t.effect}: {line}" for t in published.tests if (line := t.inconsistency()) is not None
    ]
