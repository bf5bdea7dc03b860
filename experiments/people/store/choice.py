"""Which cell the next person gets."""

from collections.abc import Sequence

import numpy as np

from experiments.people.store.values import Rule


def choose(counts: Sequence[int], quotas: Sequence[int], rule: Rule, rng: np.random.Generator) -> int | None:
    """The cell of the next person: `balanced` takes the one that is filled least, `uniform` any that has room.

    Args:
        counts: People in each cell.
        quotas: Wanted people of each cell.
        rule: The rule; ties are broken at random.
        rng: Source of chance.

    Returns:
        Index of the cell; None if all are full.
    """
    room = [cell for cell, (count, quota) in enumerate(zip(counts, quotas, strict=True)) if count < quota]
    if not room:
        return None
    if rule == "balanced":
        filled = {cell: counts[cell] / quotas[cell] for cell in room}
        least = min(filled.values())
        room = [cell for cell in room if filled[cell] == least]
    return room[int(rng.integers(len(room)))]
