"""Estimate variance components of crossed random factors by restricted maximum likelihood.

statsmodels is accurate only to 1e-4, computes no error degrees of freedom, and takes minutes for crossed
factors. Here, the deviance is evaluated with one Cholesky decomposition and minimized by Newton's method.
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize
from scipy.sparse import csr_array, diags_array, hstack, issparse
from scipy.special import chdtri

from experiments.analysis.statistics.anova import Values
from experiments.errors import StatisticsError

STARTS = np.array([0.0, 0.01, 0.1, 1.0, 10.0, 100.0])  # starting values of the variance ratios
MAX_RATIO = 1e6
NEWTON_STEPS = 30
DENSE = 400  # maximum number of levels for which the crossproducts are stored as dense matrices
PRECISION = 1e-4  # absolute precision of confidence limits


class VarianceComponents:
    """A linear model with random factors, whose variances are given as ratios to the residual variance.

    V is the covariance divided by the residual variance, and P = V^-1 - V^-1 X (X' V^-1 X)^-1 X' V^-1. All
    results are computed from the crossproducts of the indicators Z, the design X and the values y. The cost
    therefore depends on the number of factor levels and not on the number of trials. The factor with the most
    levels and the factors in which it is nested have diagonal crossproducts, so these factors are eliminated
    one by one. Large crossproducts are stored as sparse matrices.
    """

    def __init__(self, design: Values, values: Values, members: list[NDArray[np.int64]]) -> None:
        self.effect_count = design.shape[1]
        self.freedom = len(values) - self.effect_count
        self.sizes = np.array([member.max() + 1 for member in members])
        self.nested = _nested(members, self.sizes)
        self.crossed = [k for k in range(len(members)) if k not in self.nested]
        order = [*self.nested, *self.crossed]
        ends = np.cumsum(self.sizes[order]).tolist()
        self.slices = {k: slice(end - int(self.sizes[k]), end) for k, end in zip(order, ends, strict=True)}
        self.levels = ends[-1]
        self.start = ends[len(self.nested) - 1]  # index of the first level that is not eliminated
        ones, rows = np.ones(len(values)), np.arange(len(values))
        parts = [csr_array((ones, (rows, members[k]))) for k in order]
        columns = hstack([*parts, csr_array(np.column_stack([design, values]))], "csr")
        self.products = columns.T @ columns
        if self.levels <= DENSE:
            self.products = self.products.toarray()
        self._check(columns, members[order[0]])
        self.at(np.zeros(len(members)))
        self._check_variances()

    def _check(self, columns: Any, member: NDArray[np.int64]) -> None:
        """Raise `StatisticsError` if the variance of the residual or of a factor cannot be estimated."""
        trials, count = columns.shape[0], self.levels - self.start + self.effect_count
        within, _ = _swept(self.products, self.slices[self.nested[0]], np.inf)
        products = _dense(within[-count - 1 :, -count - 1 :])
        sizes, turn = np.linalg.eigh(products[:-1, :-1])
        kept = sizes > trials * columns.shape[1] * np.finfo(float).eps
        rank = self.sizes.max() + kept.sum()
        if rank >= trials:
            raise StatisticsError(
                "houses and cells are as many as people; their variances cannot be distinguished"
            )
        if rank <= self.effect_count:
            raise StatisticsError("each cell has its own house; the variance of houses is unknown")
        explained = turn[:, kept] @ ((turn[:, kept].T @ products[:-1, -1]) / sizes[kept])
        left = columns[:, -count - 1 :] @ np.append(-explained, 1.0)
        left -= (np.bincount(member, left) / np.bincount(member))[member]
        if float(np.square(left).mean()) < 1e-20:
            raise StatisticsError("people in the same house and condition do not differ")

    def _check_variances(self) -> None:
        traces = self._traces()[0]
        sizes = traces.diagonal()
        aliased = sizes.min() <= 1e-13 * self.freedom**2  # a factor is confounded with the fixed effects
        if aliased or np.linalg.cond(traces / np.sqrt(np.outer(sizes, sizes))) > 1e8:
            raise StatisticsError("the design cannot distinguish the variances of the random factors")

    def at(self, ratios: Values) -> None:
        """Fit the model by generalized least squares at the given variance ratios, shape (k,)."""
        self.ratios = ratios
        self.active = np.flatnonzero(ratios > 0.0)
        products = self.products
        for k in self.nested:
            products = _swept(products, self.slices[k], ratios[k], keep=True)[0]
        levels, effects = self.levels, slice(-self.effect_count, None)
        self.between = products[:levels, :levels]
        wide = _dense(products[:, self.start :])
        # Solve Henderson's equations for the remaining levels and the fixed effects.
        root, one = self._roots(ratios)
        inner = root[:, None] * wide[self.start : -1, :-1] * root
        inner[np.diag_indices(len(root))] += one
        core = root[:, None] * np.linalg.inv(inner) * root
        self.through, self.bent = wide[:levels, :-1], wide[:levels, :-1] @ core
        self.core, self.covariance = core, core[effects, effects]
        found = core @ wide[self.start : -1, -1]
        self.effects = found[effects]
        self.left = wide[:levels, -1] - self.through @ found  # Z' P y
        self.squares = float(wide[-1, -1] - wide[self.start : -1, -1] @ found)  # y' P y
        self.residual = self.squares / self.freedom

    def _roots(self, ratios: Values) -> tuple[Values, Values]:
        levels = np.repeat(np.sqrt(ratios[self.crossed]), self.sizes[self.crossed])
        ones = np.ones(self.effect_count)
        return np.append(levels, ones), np.append(np.ones(len(levels)), 0.0 * ones)

    def deviance(self, ratios: Values) -> float:
        """Return -2 times the restricted log likelihood at the given variance ratios, up to a constant."""
        products, fixed = self.products, 0.0
        for k in self.nested:
            products, more = _swept(products, slice(0, self.sizes[k]), ratios[k])
            fixed += more
        root, one = self._roots(ratios)
        both = np.append(root, 1.0)[:, None] * _dense(products) * np.append(root, 1.0)
        both[np.diag_indices(len(one))] += one
        steps = np.log(np.linalg.cholesky(both).diagonal())
        return fixed + 2.0 * float(steps[:-1].sum() + self.freedom * steps[-1])

    def climb(self) -> None:
        count = len(self.sizes)
        start = min((np.full(count, ratio / count) for ratio in STARTS), key=self.deviance)
        self.at(self._lowest(self.deviance, start, 1e-10)[0])
        for _ in range(NEWTON_STEPS):
            slope, curve = self._slopes_of_deviance()
            free = (self.ratios > 0.0) | (slope < 0.0)
            step = np.zeros(count)
            step[free] = -np.linalg.solve(curve[np.ix_(free, free)], slope[free])
            new = np.clip(self.ratios + step, 0.0, MAX_RATIO)
            done = np.abs(new - self.ratios).max() <= 1e-8 * (1.0 + new.max())
            self.at(new)
            if done:
                return
        raise StatisticsError("the variances of the random factors were not found")

    @staticmethod
    def _lowest(function: Any, start: Values, precision: float = 1e-6) -> tuple[Values, float]:
        """Minimize a function of the variance ratios. Return the minimizer and the minimum."""
        if not len(start):
            return start, float(function(start))
        found = minimize(
            function,
            start,
            method="L-BFGS-B",
            bounds=[(0.0, MAX_RATIO)] * len(start),
            options={"ftol": precision},
        )
        return found.x, float(found.fun)

    def share(self, k: int) -> float:
        return float(self.ratios[k] / (1.0 + self.ratios.sum()))

    def interval(self, k: int) -> tuple[float, float]:
        """Return the 95 % profile likelihood interval of the share of the variance that factor k explains."""
        lowest, limit = self.deviance(self.ratios), float(np.sqrt(chdtri(1, 0.05)))
        others, best, last = np.delete(self.ratios, k), self.share(k), MAX_RATIO / (1.0 + MAX_RATIO)

        @cache
        def above(share: float) -> float:
            nonlocal others  # start from the ratios that the previous call has found
            if share == best:
                return -limit
            odds = share / (1.0 - share)

            def of_others(ratios: Values) -> float:
                return self.deviance(np.insert(ratios, k, odds * (1.0 + ratios.sum())))

            others, height = self._lowest(of_others, others)
            return float(np.sqrt(max(height - lowest, 0.0))) - limit

        low = float(brentq(above, 0.0, best, xtol=PRECISION)) if best > 0.0 and above(0.0) > 0.0 else 0.0
        return low, float(brentq(above, best, last, xtol=PRECISION)) if above(last) > 0.0 else 1.0

    def test(self, indices: NDArray[np.int64]) -> tuple[float, int, float]:
        """Compute an F test of the fixed effects at `indices`. Return F and its two degrees of freedom.

        The degrees of freedom follow Fai and Cornelius 1996, doi:10.1080/00949659608811740.
        """
        block = self.covariance[np.ix_(indices, indices)] * self.residual
        sizes, turn = np.linalg.eigh(block)
        squares = (turn.T @ self.effects[indices]) ** 2 / sizes
        slopes = [(turn.T @ d[np.ix_(indices, indices)] @ turn).diagonal() for d in self._slopes()]
        gradient = np.array(slopes)  # derivatives of the eigenvalues by the variances, shape (k, q)
        freedom = 2.0 * sizes**2 / np.einsum("iq,ij,jq->q", gradient, self._variances(), gradient)
        q, statistic = len(indices), float(squares.mean())
        return statistic, q, _joint_freedom(freedom)

    def _slopes(self) -> list[Values]:
        effects = self.bent[:, -self.effect_count :].T
        moved = [effects[:, self.slices[k]] for k in self.active.tolist()]
        slopes = [one @ one.T for one in moved]
        factors = sum(
            (self.ratios[k] * one for k, one in zip(self.active, slopes, strict=True)), np.zeros(())
        )
        return [*slopes, self.covariance - factors]

    def _traces(self) -> tuple[Values, Values]:
        """Return the traces of P V_k P V_l, shape (k + 1, k + 1), and of P V_k, with the residual last."""
        diagonal = self.between.diagonal() - (self.bent * self.through).sum(axis=1)
        places = [self.slices[k] for k in range(len(self.sizes))]
        single = np.array([diagonal[place].sum() for place in places])
        halves = [self.core @ (self.through[place].T @ self.through[place]) for place in places]
        traces = np.zeros((len(places), len(places)))
        for k, m in np.ndindex(traces.shape):
            block = self.between[places[k], places[m]]
            # Add the squares of (sparse matrix - low-rank product) without computing this difference.
            crossing = float((self.bent[places[k]] * (block @ self.through[places[m]])).sum())
            traces[k, m] = (block**2).sum() - 2.0 * crossing + float((halves[k] * halves[m].T).sum())
        return self._with_residual(traces, single, float(self.freedom)), single

    def _with_residual(self, of_factors: Values, single: Values, total: float) -> Values:
        mixed = single - of_factors @ self.ratios
        last = total - self.ratios @ single - self.ratios @ mixed
        return np.block([[of_factors, mixed[:, None]], [mixed[None], np.array([[last]])]])

    def _quadratic_forms(self) -> tuple[Values, Values]:
        """Return y' P V_k P V_l P y, shape (k + 1, k + 1), and y' P V_k P y, with the residual last."""
        parts = np.zeros((self.levels, len(self.sizes)))
        for k, place in self.slices.items():
            parts[place, k] = self.left[place]
        crossed = parts.T @ (self.between @ parts) - parts.T @ self.bent @ (self.through.T @ parts)
        single = (parts**2).sum(axis=0)
        return self._with_residual(crossed, single, self.squares), single

    def _slopes_of_deviance(self) -> tuple[Values, Values]:
        """Return the gradient of the deviance with respect to the variance ratios, and its Hessian."""
        traces, single = self._traces()
        moved, squares = self._quadratic_forms()
        squares = squares / self.residual
        curve = 2.0 * moved[:-1, :-1] / self.residual - traces[:-1, :-1]
        return single - squares, curve - np.outer(squares, squares) / self.freedom

    def _variances(self) -> Values:
        kept = np.append(self.active, len(self.sizes))
        observed = self._quadratic_forms()[0] / self.residual - self._traces()[0] / 2.0
        return np.asarray(np.linalg.inv(observed[np.ix_(kept, kept)]) * self.residual**2)


def _nested(members: list[NDArray[np.int64]], sizes: NDArray[np.int64]) -> list[int]:
    """Return the indices of the factor with the most levels and of the factors in which it is nested."""
    first, *rest = np.argsort(-sizes, kind="stable").tolist()
    chain = [first]
    for k in rest:
        fine = members[chain[-1]]
        if len(np.unique(fine * sizes[k] + members[k])) == sizes[chain[-1]]:
            chain.append(k)
    return chain


def _swept(products: Any, place: slice, ratio: float, *, keep: bool = False) -> tuple[Any, float]:
    """Eliminate a factor from the crossproducts. Return the crossproducts and the log determinant."""
    block = products[place]
    counts = block[:, place].diagonal()
    shrink = np.zeros(len(counts)) if ratio == 0.0 else 1.0 / (1.0 / ratio + counts)
    if not keep:
        products, block = products[place.stop :, place.stop :], block[:, place.stop :]
    if ratio > 0.0:
        scaled = diags_array(shrink) @ block if issparse(block) else shrink[:, None] * block
        products = products - block.T @ scaled
    return products, float(np.log1p(counts * ratio).sum())


def _dense(matrix: Any) -> Values:
    return np.asarray(matrix.toarray() if issparse(matrix) else matrix)


def _joint_freedom(freedom: Values) -> float:
    if np.ptp(freedom) < 1e-8 * freedom.max():
        return float(freedom.mean())
    expected = float((freedom / (freedom - 2.0))[freedom > 2.0].sum())
    return 2.0 * expected / (expected - len(freedom)) if expected > len(freedom) else 1.0
