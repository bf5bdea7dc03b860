"""All kinds of furniture."""

from mjsim.houses.furniture import bath, beds, decoration, kitchen, living, plants, seats, storage, tables
from mjsim.houses.furniture.piece import Kind

_FAMILIES = (beds, seats, tables, storage, kitchen, bath, living, plants, decoration)
KINDS: dict[str, Kind] = {kind.name: kind for family in _FAMILIES for kind in family.KINDS}


def kinds_for(use: str) -> list[Kind]:
    """Kinds that belong to rooms of a use, such as "bedroom"."""
    return [kind for kind in KINDS.values() if use in kind.uses]
