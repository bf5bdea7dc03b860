"""All kinds of furniture."""

from mjsim.generator.furniture import bath, beds, decoration, kitchen, living, plants, seats, storage, tables
from mjsim.generator.furniture.builder import Kind

_FAMILIES = (beds, seats, tables, storage, kitchen, bath, living, plants, decoration)
KINDS = {draw.__name__: Kind(draw.__name__, draw) for family in _FAMILIES for draw in family.KINDS}
