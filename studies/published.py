"""The published statistics: studies/published.toml."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import msgspec
from scipy.stats import f

from experiments.analysis.statistics.effects import ALPHA, FTest, Interval, partial_eta_squared

FILE = Path(__file__).with_name("published.toml")
NOT_SIGNIFICANT = "n.s."


class PublishedTest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An F test as printed.

    Attributes:
        measure: Short name of the measure.
        effect: What it tests.
        df: Degrees of freedom, of the effect and of the error.
        p: As printed: `=.523` or `n.s.`; None where none is.
        objects: At which number of objects; None over all.
        statistic: F, or None where it is not printed.
        p_fits: False where the p printed with F is known not to go with it.
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
        """Whether it may be fitted: over all numbers of objects, nothing is."""
        return self.objects is not None

    @property
    def significant(self) -> bool:
        """The decision at .05: by the printed p, else by F."""
        if self.p is None:
            return float(f.sf(self.statistic, *self.df)) < ALPHA
        return self.p != NOT_SIGNIFICANT and float(self.p[1:]) < ALPHA

    def test(self, people: int) -> FTest | None:
        """The test with its effect size; None where F is not printed."""
        return None if self.statistic is None else FTest(self.statistic, *self.df, people)

    def interval(self, people: int) -> Interval | None:
        """What partial eta squared may be: its 90 % confidence interval, or all that stays without significance."""
        test = self.test(people)
        if test is not None:
            return test.interval
        return 0.0, partial_eta_squared(float(f.ppf(1.0 - ALPHA, *self.df)), *self.df)

    def inconsistency(self) -> str | None:
        """What is wrong between the printed F and p; None where they go together."""
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
    """An order of means as printed; `pair` or one of the last four says which.

    Attributes:
        measure: Short name of the measure.
        objects: At which number of objects; None over all.
        pair: The first is smaller than the second by Tukey's test.
        p: Of that test, as printed.
        same: Tukey's test finds no difference.
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
        """What it says, in words."""
        if self.pair is not None:
            return " < ".join(self.pair)
        if self.same is not None:
            return " ~ ".join(self.same)
        if self.rising is not None:
            return f"rises with objects under {self.rising}"
        return f"{self.lowest} lowest" if self.lowest is not None else " > ".join(self.falling or ())


class Variances(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The condition in which a measure varies most, at every number of objects."""

    measure: str
    largest: str


class People(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """People by condition, for each number of objects."""

    objects: tuple[int, ...]
    none: tuple[int, ...]
    highlight: tuple[int, ...]
    optimal: tuple[int, ...]

    def sizes(self) -> dict[tuple[str, int], int]:
        """People by cell."""
        rows = {"none": self.none, "highlight": self.highlight, "optimal": self.optimal}
        return {(c, n): k for c, counts in rows.items() for n, k in zip(self.objects, counts, strict=True)}


class Published(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """All that is scored."""

    people: People
    tests: tuple[PublishedTest, ...]
    directions: tuple[Direction, ...]
    variances: Variances

    def people_of(self, objects: int | None) -> int:
        """How many people took part at a number of objects, or in all."""
        return sum(k for (_, n), k in self.people.sizes().items() if objects in (None, n))


def read_published(path: Path = FILE) -> Published:
    """The committed numbers."""
    return msgspec.toml.decode(path.read_bytes(), type=Published)


def inconsistencies(published: Published) -> Sequence[str]:
    """What is inconsistent in the published numbers, a line each."""
    return [
        f"{t.measure}, {t.effect}: {line}" for t in published.tests if (line := t.inconsistency()) is not None
    ]
