"""Which objects a relaxation counts together."""

import numpy as np
from numpy.typing import NDArray

from planner.exact.table import rows_of

BIN_ROWS = 50_000  # of a table that counts objects by bin: 30 objects and 6 bins


def together(n: int) -> NDArray[np.int64]:
    """Group of each object, all in one, (n,)."""
    return np.zeros(n, np.int64)


def alone(n: int) -> NDArray[np.int64]:
    """Group of each object, each in its own, (n,)."""
    return np.arange(n, dtype=np.int64)


def numbered(labels: NDArray[np.int64]) -> NDArray[np.int64]:
    """The same groups with numbers 0, 1, 2 and so on, (n,)."""
    return np.unique(labels, return_inverse=True)[1].astype(np.int64)


def with_one_alone(
    group: NDArray[np.int64], violation: NDArray[np.float64], max_rows: int
) -> NDArray[np.int64] | None:
    """Give one object a group of its own.

    Args:
        group: Group of each object, numbered from 0, (n,).
        violation: The object with the largest one is taken, (n,).
        max_rows: Of the table afterwards.

    Returns:
        The new groups; None if all objects are alone or the table would be too large.
    """
    size = np.bincount(group)[group] if len(group) else group
    if size.max(initial=1) == 1:
        return None
    new = group.copy()
    new[np.argmax(np.where(size > 1, violation, -1.0))] = group.max() + 1
    return new if rows_of(new) <= max_rows else None
