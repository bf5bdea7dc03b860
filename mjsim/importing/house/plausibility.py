"""Warn about imported houses that probably differ from the original, or that are too small for a study."""

from collections.abc import Iterator

from mjsim.house.validation.findings import Finding
from mjsim.importing.house.floor_grid import FloorGrid

RULES = ("outline", "area", "places")  # names of the rules that a usable house keeps
_AREA = (8.0, 400.0)  # range of plausible walkable areas, in square metres
_MIN_PLACES = 6  # minimum number of places for objects at least a metre apart


def doubts(grid: FloorGrid, places: int) -> Iterator[Finding]:
    """Yield a warning for each rule of a usable house that an imported house breaks."""
    if not grid.enclosed:
        outside = f"{100 * grid.outside_share:.0f} % of its floor is outside of the walls"
        yield _warning(
            "outline",
            f"no walls enclose its floor, so it is a rectangle around the obstacles, and {outside}",
            "close openings in the source that are wider than 1.2 m",
        )
    if not _AREA[0] <= grid.area <= _AREA[1]:
        yield _warning(
            "area",
            f"it has {grid.area:.0f} m2 of walkable floor, and homes have {_AREA[0]:g} to {_AREA[1]:g} m2",
            "check the size (--units, --scale), or import a part of the source",
        )
    if places < _MIN_PLACES:
        yield _warning(
            "places",
            f"{places} places for objects fit at least 1 m from each other and from the bins, instead of {_MIN_PLACES}",
            "remove furniture in the source",
        )


def _warning(rule: str, message: str, remedy: str) -> Finding:
    return Finding(rule, "house", message, remedy, "warning")
