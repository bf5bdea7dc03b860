"""A linear model with crossed random factors, such as person and house, by restricted maximum likelihood.

statsmodels climbs to 1e-4, has no degrees of freedom of the error, and needs minutes for crossed factors. Here the
deviance at given ratios of variances is one Cholesky decomposition, and Newton's steps lead to its minimum.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import brentq, minimize
from scipy.sparse import csr_array
from scipy.special import chdtri, fdtrc

from experiments.analysis.statistics.anova import Values, cells_of, varies
from experiments.errors import StatisticsError

MIN_LEVELS = 5  # fewer say little about the variance between them
STARTS = np.array([0.0, 0.01, 0.1, 1.0, 10.0, 100.0])  # ratios of variances tried first
MOST = 1e6  # the largest ratio
NEWTON_STEPS = 30
DENSE = 10_000  # elements of a matrix that is mostly 0, above which it is stored as a sparse one
PRECISION = 1e-4  # of the ends of intervals


@dataclass(frozen=True)
class WaldTest:
    """A Wald F test of a model's term, with Satterthwaite's degrees of freedom of the error."""

    statistic: float  # F
    df1: int
    df2: float
    p: float


@dataclass(frozen=True)
class RandomFactor:
    """A random factor of a model."""

    levels: int
    variance: float  # between levels, in squared units of the measure
    share: float  # of the variance within conditions, from 0 to 1
    # its 95 % interval, by the profile of the restricted likelihood; None in models with a covariate
    interval: tuple[float, float] | None


@dataclass(frozen=True)
class MixedModel:
    """A linear model with crossed random factors."""

    # by effect: `assistance`, and where there are several levels, `objects` and `interaction`; then the covariate's
    tests: Mapping[str, WaldTest]
    random: Mapping[str, RandomFactor]  # by name
    residual_variance: float  # what is left, in squared units of the measure


def mixed_model(
    values: Values,
    assistance: NDArray[Any],
    objects: NDArray[Any],
    random: Mapping[str, NDArray[Any]],
    covariate: tuple[str, Values] | None = None,
) -> MixedModel:
    """Fit assistance, number of objects and both together as fixed effects, and random intercepts of the factors.

    All arrays have one entry per trial, (n,). A covariate, with its name, is linear, and so is its part in the
    differences between conditions. Raises `StatisticsError` if levels are few, a cell is empty or the variances cannot
    be told apart.
    """
    members = {name: np.unique(levels, return_inverse=True)[1] for name, levels in random.items()}
    for name, member in members.items():
        if member.max() + 1 < MIN_LEVELS and name != "trial_number":
            raise StatisticsError(
                f"a mixed model needs at least {MIN_LEVELS} levels of {name}; there are {member.max() + 1}"
            )
    if not varies(values):
        raise StatisticsError("the values do not vary")
    cells = cells_of(values, assistance, objects)
    columns = {effect: block[cells.member] for effect, block in cells.columns.items()}
    if covariate is not None:
        columns |= _with_covariate(*covariate, columns["assistance"])
    unit = float(values.std())
    fit = _Fit(np.hstack(list(columns.values())), values / unit, list(members.values()))
    fit.climb()
    tests, start = {}, 1
    for effect, block in list(columns.items())[1:]:
        tests[effect] = fit.test(np.arange(start, start + block.shape[1]))
        start += block.shape[1]
    within = fit.residual * unit**2
    factors = {
        name: RandomFactor(
            int(fit.sizes[k]),
            float(fit.ratios[k]) * within,
            fit.share(k),
            None if covariate else fit.interval(k),
        )
        for k, name in enumerate(members)
    }
    return MixedModel(tests, factors, within)


def _with_covariate(name: str, values: Values, conditions: Values) -> dict[str, Values]:
    if not varies(values):
        raise StatisticsError(f"{name} is the same everywhere")
    column = ((values - values.mean()) / values.std())[:, None]
    return {name: column, f"{name} x assistance": column * conditions}


class _Fit:
    """The model at ratios of the variances (factors over residual); V is the covariance over the residual variance."""

    def __init__(self, design: Values, values: Values, members: list[NDArray[np.int64]]) -> None:
        self.design, self.values = design, values
        self.freedom = len(values) - design.shape[1]
        parts = [1.0 * (member[:, None] == np.arange(member.max() + 1)) for member in members]
        self.sizes = np.array([part.shape[1] for part in parts])
        self.random, self.factor = np.hstack(parts), np.repeat(np.arange(len(parts)), self.sizes)
        self._check()
        # What the deviance depends on. The largest factor, whose crossproduct is diagonal, is eliminated first.
        self.first = int(self.sizes.argmax())
        self.at(np.zeros(len(parts)))
        if self.residual <= 1e-20:
            raise StatisticsError("the values do not vary within any cell")
        rest = np.hstack([self.random[:, self.factor != self.first], design, self.left[:, None]])
        self.counts = parts[self.first].sum(axis=0)
        self.by_first, self.inner = parts[self.first].T @ rest, rest.T @ rest
        if self.by_first.size > DENSE:
            self.by_first = csr_array(self.by_first)
        self._check_variances()

    def _check(self) -> None:
        both = np.hstack([self.design, self.random])
        sizes, turn = np.linalg.eigh(both.T @ both)
        kept = sizes > sizes[-1] * len(sizes) * np.finfo(float).eps
        if kept.sum() >= len(self.values):
            raise StatisticsError("there are as many houses and cells as people; their variances are one")
        if kept.sum() <= self.design.shape[1]:
            raise StatisticsError("each cell has houses of its own, one each; their variance is not known")
        told = turn[:, kept] @ ((turn[:, kept].T @ (both.T @ self.values)) / sizes[kept])
        if float(np.square(self.values - both @ told).mean()) < 1e-20:
            raise StatisticsError("people in the same house and condition do not differ")

    def _check_variances(self) -> None:
        traces = self._traces()[0]
        scale = np.sqrt(traces.diagonal())
        if scale.min() <= 0 or np.linalg.cond(traces / np.outer(scale, scale)) > 1e8:
            raise StatisticsError("the design cannot tell the variances of the random factors apart")

    def at(self, ratios: Values) -> None:
        """Generalised least squares at ratios, (k,)."""
        self.ratios = ratios
        self.active = np.flatnonzero(ratios > 0.0)
        self.here = self.random[:, ratios[self.factor] > 0.0]
        self.owner = self.factor[ratios[self.factor] > 0.0]
        self.root = np.sqrt(ratios[self.owner])
        inner = self.root[:, None] * (self.here.T @ self.here) * self.root
        self.core = cho_factor(inner + np.eye(len(inner))) if len(inner) else None
        self.weighted = self._inverse(self.design)  # V^-1 X
        self.covariance = np.linalg.inv(self.design.T @ self.weighted)
        self.effects = self.covariance @ (self.weighted.T @ self.values)
        self.left = self._project(self.values)  # P y
        self.residual = float(self.values @ self.left) / self.freedom

    def _inverse(self, v: Values) -> Values:
        if self.core is None:
            return v
        scaled = self.here * self.root
        return np.asarray(v - scaled @ cho_solve(self.core, scaled.T @ v))

    def _project(self, v: Values) -> Values:
        """P v, with P = V^-1 - V^-1 X (X' V^-1 X)^-1 X' V^-1."""
        return self._inverse(v) - self.weighted @ (self.covariance @ (self.weighted.T @ v))

    def deviance(self, ratios: Values) -> float:
        """Minus twice the restricted log likelihood at ratios, (k,), up to a constant."""
        ratio = ratios[self.first]
        shrink = ratio / (1.0 + self.counts * ratio)
        both = self.inner - self.by_first.T @ (self.by_first * shrink[:, None])
        others = self.factor[self.factor != self.first]
        root = np.append(np.sqrt(ratios[others]), np.ones(len(both) - len(others)))
        both *= np.outer(root, root)
        both[np.arange(len(others)), np.arange(len(others))] += 1.0
        steps = np.log(np.linalg.cholesky(both).diagonal())
        fixed = 2.0 * float(steps[:-1].sum() + self.freedom * steps[-1])
        return fixed + float(np.log1p(self.counts * ratio).sum())

    def climb(self) -> None:
        """Go to the ratios of the largest likelihood."""
        count = len(self.sizes)
        start = min((np.full(count, ratio / count) for ratio in STARTS), key=self.deviance)
        self.at(self._lowest(self.deviance, start)[0])
        for _ in range(NEWTON_STEPS):
            slope, curve = self._slopes_of_deviance()
            free = (self.ratios > 0.0) | (slope < 0.0)
            step = np.zeros(count)
            step[free] = -np.linalg.solve(curve[np.ix_(free, free)], slope[free])
            new = np.clip(self.ratios + step, 0.0, MOST)
            done = np.abs(new - self.ratios).max() <= 1e-12 * (1.0 + new.max())
            self.at(new)
            if done:
                return
        raise StatisticsError("the variances of the random factors were not found")

    @staticmethod
    def _lowest(function: Any, start: Values) -> tuple[Values, float]:
        """Where a function of ratios is lowest, and how low."""
        if not len(start):
            return start, float(function(start))
        found = minimize(
            function, start, method="L-BFGS-B", bounds=[(0.0, MOST)] * len(start), options={"ftol": 1e-6}
        )
        return found.x, float(found.fun)

    def share(self, k: int) -> float:
        """Share of a factor in the variance."""
        return float(self.ratios[k] / (1.0 + self.ratios.sum()))

    def interval(self, k: int) -> tuple[float, float]:
        """Shares of a factor in the variance that a likelihood ratio test at 5 % does not refuse."""
        lowest, limit = self.deviance(self.ratios), float(np.sqrt(chdtri(1, 0.05)))
        others = np.delete(self.ratios, k)

        def above(share: float) -> float:
            nonlocal others  # near those of the last share
            odds = share / (1.0 - share)

            def of_others(ratios: Values) -> float:
                return self.deviance(np.insert(ratios, k, odds * (1.0 + ratios.sum())))

            others, height = self._lowest(of_others, others)
            return float(np.sqrt(max(height - lowest, 0.0))) - limit  # the root is nearly straight

        best, last = self.share(k), MOST / (1.0 + MOST)
        low = float(brentq(above, 0.0, best, xtol=PRECISION)) if best > 0.0 and above(0.0) > 0.0 else 0.0
        return low, float(brentq(above, best, last, xtol=PRECISION)) if above(last) > 0.0 else 1.0

    def test(self, places: NDArray[np.int64]) -> WaldTest:
        """Test of the effects at these places of the design.

        Source of the degrees of freedom: Fai and Cornelius 1996, doi:10.1080/00949659608811740.
        """
        block = self.covariance[np.ix_(places, places)] * self.residual
        sizes, turn = np.linalg.eigh(block)
        squares = (turn.T @ self.effects[places]) ** 2 / sizes
        slopes = [(turn.T @ d[np.ix_(places, places)] @ turn).diagonal() for d in self._slopes()]
        gradient = np.array(slopes)  # of `sizes` by the variances, (k, q)
        freedom = 2.0 * sizes**2 / np.einsum("iq,ij,jq->q", gradient, self._variances(), gradient)
        q, statistic = len(places), float(squares.mean())
        df2 = _joint_freedom(freedom)
        return WaldTest(statistic, q, df2, float(fdtrc(q, df2, statistic)))

    def _slopes(self) -> list[Values]:
        """Derivatives of the covariance of the effects by the variances: of the factors above 0, and the residual."""
        through = self.covariance @ self.weighted.T
        moved = [through @ self.here[:, self.owner == k] for k in self.active]
        return [one @ one.T for one in (*moved, through)]

    def _traces(self) -> tuple[Values, Values]:
        """Of P V_k P V_l for all factors and the residual, (k + 1, k + 1), and of P V_k, (k,)."""
        inner = self._project(self.random)
        squares = (self.random.T @ inner) ** 2
        groups = 1.0 * (self.factor[:, None] == np.arange(len(self.sizes)))
        between = groups.T @ squares @ groups
        mixed = (inner**2).sum(axis=0) @ groups
        single = (self.random * inner).sum(axis=0) @ groups
        total = self.freedom - self.ratios @ single - self.ratios @ mixed
        return np.block([[between, mixed[:, None]], [mixed[None], np.array([[total]])]]), single

    def _moved(self) -> Values:
        """V_k P y for all factors and the residual, (n, k + 1)."""
        parts = [self.random[:, self.factor == k] for k in range(len(self.sizes))]
        return np.stack([*(part @ (part.T @ self.left) for part in parts), self.left], axis=1)

    def _slopes_of_deviance(self) -> tuple[Values, Values]:
        """First and second derivatives of the deviance by the ratios, (k,) and (k, k)."""
        traces, single = self._traces()
        moved = self._moved()[:, :-1]
        squares = self.left @ moved / self.residual
        curve = 2.0 * moved.T @ self._project(moved) / self.residual - traces[:-1, :-1]
        return single - squares, curve - np.outer(squares, squares) / self.freedom

    def _variances(self) -> Values:
        """Covariance of the estimated variances by second derivatives of the likelihood; those at 0 are left out."""
        kept = np.append(self.active, len(self.sizes))
        moved = self._moved()[:, kept]
        traces = self._traces()[0][np.ix_(kept, kept)]
        observed = moved.T @ self._project(moved) / self.residual - traces / 2.0
        return np.asarray(np.linalg.inv(observed) * self.residual**2)


def _joint_freedom(freedom: Values) -> float:
    """Degrees of freedom of an F whose parts have their own, (q,)."""
    if np.ptp(freedom) < 1e-8 * freedom.max():
        return float(freedom.mean())
    expected = float((freedom / (freedom - 2.0))[freedom > 2.0].sum())
    return 2.0 * expected / (expected - len(freedom)) if expected > len(freedom) else 1.0
