"""A linear model with houses as a random factor, by restricted maximum likelihood.

statsmodels climbs to 1e-4 and has no degrees of freedom of the error; with one random factor the likelihood has one
unknown ratio of variances, whose root is found to rounding.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import chdtri, fdtrc

from experiments.analysis.statistics.anova import Values, cells_of, varies
from experiments.errors import StatisticsError

MIN_HOUSES = 5  # fewer say little about the variance between houses
RATIOS = np.concatenate([[0.0], np.geomspace(1e-6, 1e6, 73)])  # of variances, searched for the best


@dataclass(frozen=True)
class WaldTest:
    """A Wald F test of a model's term, with Satterthwaite's degrees of freedom of the error."""

    statistic: float  # F
    df1: int
    df2: float
    p: float


@dataclass(frozen=True)
class MixedModel:
    """A linear model with houses as a random factor."""

    # by effect: `assistance`, and where there are several levels, `objects` and `interaction`
    tests: Mapping[str, WaldTest]
    house_variance: float  # variance between houses, in squared units of the measure
    residual_variance: float  # variance between people in a house
    houses: int  # number of houses
    share: float  # of the variance within conditions that is between houses, from 0 to 1
    interval: tuple[float, float]  # its 95 % interval, by the profile of the restricted likelihood


def mixed_model(
    values: Values, assistance: NDArray[Any], objects: NDArray[Any], houses: NDArray[Any]
) -> MixedModel:
    """Fit assistance, number of objects and both together as fixed effects, and houses as a random one.

    All arrays have one entry per person, (n,). Raises `StatisticsError` if houses are few, a cell is empty or it fails.
    """
    names, member = np.unique(houses, return_inverse=True)
    if len(names) < MIN_HOUSES:
        raise StatisticsError(f"a mixed model needs at least {MIN_HOUSES} houses; there are {len(names)}")
    if not varies(values):
        raise StatisticsError("the values do not vary")
    cells = cells_of(values, assistance, objects)
    columns = {effect: block[cells.member] for effect, block in cells.columns.items()}
    unit = float(values.std())
    fit = _Fit(np.hstack(list(columns.values())), values / unit, np.eye(len(names))[member])
    fit.climb()
    tests, start = {}, 1
    for effect, block in list(columns.items())[1:]:
        tests[effect] = fit.test(np.arange(start, start + block.shape[1]))
        start += block.shape[1]
    between, within = fit.ratio * fit.residual * unit**2, fit.residual * unit**2
    return MixedModel(tests, between, within, len(names), _share(fit.ratio), fit.interval())


class _Fit:
    """The model at a ratio of the variances (houses over people); V is the covariance over the residual variance."""

    def __init__(self, design: Values, values: Values, member: Values) -> None:
        self.design, self.values, self.member = design, values, member
        self.freedom = len(values) - design.shape[1]
        both = np.hstack([design, member])
        within = np.linalg.matrix_rank(both.T @ both, hermitian=True)
        if within >= len(values):
            raise StatisticsError("there are as many houses and cells as people; their variances are one")
        if within <= design.shape[1]:
            raise StatisticsError("each cell has houses of its own, one each; their variance is not known")
        self.at(0.0)
        if self.residual <= 1e-20:
            raise StatisticsError("the values do not vary within any cell")
        # What the likelihood depends on, from here on of the residuals without houses.
        self.inner, self.by_house = design.T @ design, member.T @ design
        self.people, self.sums, self.squares = member.sum(axis=0), member.T @ self.left, self.left @ self.left

    def at(self, ratio: float) -> None:
        """Generalised least squares at a ratio."""
        self.ratio = ratio
        self.shrink = ratio / (1.0 + self.member.sum(axis=0) * ratio)
        self.weighted = self._inverse(self.design)  # V^-1 X
        self.covariance = np.linalg.inv(self.design.T @ self.weighted)
        self.effects = self.covariance @ (self.weighted.T @ self.values)
        self.left = self._project(self.values)  # P y
        self.residual = float(self.values @ self.left) / self.freedom

    def _inverse(self, v: Values) -> Values:
        shrink = self.shrink if v.ndim == 1 else self.shrink[:, None]
        return np.asarray(v - self.member @ (shrink * (self.member.T @ v)))

    def _project(self, v: Values) -> Values:
        """P v, with P = V^-1 - V^-1 X (X' V^-1 X)^-1 X' V^-1."""
        return self._inverse(v) - self.weighted @ (self.covariance @ (self.weighted.T @ v))

    def _deviance(self, ratios: Values) -> Values:
        """Minus twice the restricted log likelihood at each ratio, up to a constant, (r,)."""
        shrink = ratios[:, None] / (1.0 + self.people * ratios[:, None])
        inner = self.inner - np.einsum("rg,gp,gq->rpq", shrink, self.by_house, self.by_house)
        moved = (shrink * self.sums) @ self.by_house
        effects = np.linalg.solve(inner, moved[:, :, None])[:, :, 0]
        squares = self.squares - shrink @ self.sums**2 - (moved * effects).sum(axis=1)
        houses = np.log1p(self.people * ratios[:, None]).sum(axis=1)
        return np.asarray(
            self.freedom * np.log(squares / self.freedom) + houses + np.linalg.slogdet(inner)[1]
        )

    def _slope(self, ratio: float) -> float:
        """Its derivative by the ratio."""
        weight = 1.0 / (1.0 + self.people * ratio)
        shrink = ratio * weight
        covariance = np.linalg.inv(self.inner - (self.by_house * shrink[:, None]).T @ self.by_house)
        moved = (shrink * self.sums) @ self.by_house
        weighted = weight[:, None] * self.by_house
        squares = self.squares - shrink @ self.sums**2 - moved @ covariance @ moved
        left = weight * self.sums + weighted @ (covariance @ moved)
        trace = (self.people * weight).sum() - ((weighted @ covariance) * weighted).sum()
        return float(trace - left @ left / (squares / self.freedom))

    def climb(self) -> None:
        """Go to the ratio of the largest likelihood."""
        best = int(np.argmin(self._deviance(RATIOS)))
        if best == len(RATIOS) - 1:
            raise StatisticsError("people in the same house and condition do not differ")
        low, high = RATIOS[max(best - 1, 0)], RATIOS[best + 1]
        if self._slope(low) < 0.0 < self._slope(high):
            self.at(float(brentq(self._slope, low, high, xtol=1e-15, rtol=1e-13)))
        else:
            self.at(0.0)

    def interval(self) -> tuple[float, float]:
        """Shares of the variance between houses that a likelihood ratio test at 5 % does not refuse."""
        limit = float(self._deviance(np.array([self.ratio]))[0] + chdtri(1, 0.05))

        def above(share: float) -> float:
            return float(self._deviance(np.array([share / (1.0 - share)]))[0]) - limit

        best, last = _share(self.ratio), _share(RATIOS[-1])
        low = float(brentq(above, 0.0, best)) if above(0.0) > 0.0 else 0.0
        return low, float(brentq(above, best, last)) if above(last) > 0.0 else 1.0

    def test(self, places: NDArray[np.int64]) -> WaldTest:
        """Test of the effects at these places of the design.

        Source of the degrees of freedom: Fai and Cornelius 1996, doi:10.1080/00949659608811740.
        """
        block = self.covariance[np.ix_(places, places)] * self.residual
        sizes, turn = np.linalg.eigh(block)
        squares = (turn.T @ self.effects[places]) ** 2 / sizes
        slopes = [(turn.T @ d[np.ix_(places, places)] @ turn).diagonal() for d in self._slopes()]
        gradient = np.array(slopes)  # of `sizes` by both variances, (2, q)
        freedom = 2.0 * sizes**2 / np.einsum("iq,ij,jq->q", gradient, self._variances(), gradient)
        q, statistic = len(places), float(squares.mean())
        df2 = _joint_freedom(freedom)
        return WaldTest(statistic, q, df2, float(fdtrc(q, df2, statistic)))

    def _slopes(self) -> tuple[Values, Values]:
        """Derivatives of the covariance of the effects by the variances of houses and of people."""
        houses = self.covariance @ (self.weighted.T @ self.member)
        people = self.covariance @ self.weighted.T
        return houses @ houses.T, people @ people.T

    def _variances(self) -> Values:
        """Covariance of both estimated variances, from the second derivatives of the restricted likelihood."""
        if self.ratio == 0.0:  # at the edge, only that of people is free
            return np.diag([0.0, 2.0 * self.residual**2 / self.freedom])
        inner = self._project(self.member)
        between = self.member.T @ inner
        total = self.freedom - self.ratio * np.trace(between)
        mixed = float((inner**2).sum())
        traces = np.array([[(between**2).sum(), mixed], [mixed, total - self.ratio * mixed]])
        moved = np.stack([self.member @ (self.member.T @ self.left), self.left], axis=1)
        observed = moved.T @ self._project(moved) / self.residual - traces / 2.0
        return np.asarray(np.linalg.inv(observed) * self.residual**2)


def _share(ratio: float) -> float:
    return float(ratio / (1.0 + ratio))


def _joint_freedom(freedom: Values) -> float:
    """Degrees of freedom of an F whose parts have their own, (q,)."""
    if np.ptp(freedom) < 1e-8 * freedom.max():
        return float(freedom.mean())
    expected = float((freedom / (freedom - 2.0))[freedom > 2.0].sum())
    return 2.0 * expected / (expected - len(freedom)) if expected > len(freedom) else 1.0
