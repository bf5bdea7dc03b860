"""Finds the installed package that computes where one can walk.

Sampling a house needs a navigable floor. The navmesh belongs to the planner, which mjsim must not import, so mjsim
defines a protocol and loads the entry point `mjsim.navigable`. This project registers the planner's navmesh there.
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
        """Compute where one can walk.

        Args:
            obstacles: Convex polygons, m, each of shape (vertices, 2).
            bounds: (x_min, y_min, x_max, y_max), m.
        """
        ...


def installed_builder(group: str = GROUP) -> NavigableBuilder:
    """The builder that an installed package registers; of several, the first by name.

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
