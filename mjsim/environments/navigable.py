"""Where one can walk, from whichever package offers to work it out.

Sampling a house needs a navigable floor, and the navmesh is the planner's, which mjsim may not import. So mjsim
names what it needs as a protocol, and takes what an installed distribution offers in the entry-point group
`mjsim.navigable`. This project's own entry is the planner's navmesh.
"""

from collections.abc import Sequence
from importlib.metadata import entry_points
from typing import Protocol

from numpy.typing import ArrayLike

from mjsim.environments.errors import EnvironmentConfigError
from mjsim.model.sampling import NavigablePoints

GROUP = "mjsim.navigable"


class NavigableBuilder(Protocol):
    """Makes the navigable floor of a house."""

    def __call__(self, obstacles: Sequence[ArrayLike], bounds: Sequence[float], /) -> NavigablePoints:
        """Work out where one can walk.

        Args:
            obstacles: Convex polygons, m, each (k, 2).
            bounds: (x_min, y_min, x_max, y_max), m.
        """
        ...


def installed_builder(group: str = GROUP) -> NavigableBuilder:
    """The builder that an installed distribution offers; of several, the first by name.

    Raises:
        EnvironmentConfigError: None is installed, or it cannot be loaded.
    """
    offers = sorted(entry_points(group=group), key=lambda e: e.name)
    if not offers:
        raise EnvironmentConfigError(
            f"no installed package offers the entry point {group!r}, without which no house can be sampled; "
            "install the project (pip install -e .), pass navigable=..., or pass episodes=[...] sampled before"
        )
    try:
        builder: NavigableBuilder = offers[0].load()
    except (ImportError, AttributeError) as error:
        raise EnvironmentConfigError(
            f"cannot load {offers[0].value!r}, which offers {group!r}: {error}"
        ) from error
    return builder
