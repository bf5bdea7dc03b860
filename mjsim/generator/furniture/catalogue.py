"""A registry of all furniture types. Each public function of the imported modules creates one type."""

from inspect import isfunction

from mjsim.generator.furniture import bath, beds, decoration, kitchen, living, plants, seats, storage, tables
from mjsim.generator.furniture.builder import Kind

KINDS = {
    name: Kind(name, draw)
    for module in (beds, seats, tables, storage, kitchen, bath, living, plants, decoration)
    for name, draw in vars(module).items()
    if isfunction(draw) and draw.__module__ == module.__name__ and not name.startswith("_")
}
