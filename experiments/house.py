"""A house made ready once and used for many episodes: catalogue, navmesh, geodesics, rooms, receptacles."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from experiments.known_house import KnownHouse, spread_viewpoints
from mjsim.episode import Episode
from mjsim.model.avatar import TRUNK_RADIUS
from mjsim.model.catalogue import Catalogue
from mjsim.model.house import compiled_house
from mjsim.model.receptacles import ReceptacleGeometry
from mjsim.model.rooms import RoomMap
from mjsim.model.sampling import sample_episode
from planner.geodesics import Geodesics
from planner.navmesh import NavMesh

VIEWPOINT_SPACING = 2.2  # m; from each one sees what lies within it in spite of furniture
VIEWPOINT_CANDIDATES = 3000


@dataclass(frozen=True, eq=False)
class House:
    """Everything about a house that no episode changes.

    Attributes:
        catalogue: Rooms, categories, receptacles and object models.
        navmesh: Navigability from the compiled model's own geoms.
        geodesics: Shortest paths on it, for planning and guidance: a little away from the walls.
        rooms: Which room a point lies in.
        receptacles: Receptacle key -> geometry.
        bounds: (x_min, y_min, x_max, y_max) of the floor, m.
    """

    catalogue: Catalogue
    navmesh: NavMesh
    geodesics: Geodesics
    rooms: RoomMap
    receptacles: Mapping[str, ReceptacleGeometry]
    bounds: tuple[float, float, float, float]

    @classmethod
    def load(cls, name: str = "apartment") -> "House":
        """Compile a house and work out where one can walk.

        Args:
            name: Name under `models/houses`, or the path of a `catalogue.toml`.

        Raises:
            AssetError: The house cannot be read, or does not compile.
        """
        catalogue = Catalogue.load(name)
        model = compiled_house(catalogue)
        floor = model.floor
        navmesh = NavMesh.build(floor.obstacles, floor.bounds)
        return cls(
            catalogue=catalogue,
            navmesh=navmesh,
            geodesics=Geodesics(navmesh),
            rooms=model.rooms,
            receptacles=model.receptacles,
            bounds=floor.bounds,
        )

    @cached_property
    def body_geodesics(self) -> Geodesics:
        """Shortest paths of somebody who brushes along the walls; no walk is shorter."""
        floor = compiled_house(self.catalogue).floor
        return Geodesics(NavMesh.build(floor.obstacles, floor.bounds, agent_radius=TRUNK_RADIUS))

    def sample_episode(self, *, objects: int, seed: int) -> Episode:
        """Sample a disorganized house (PAPER section 4).

        Raises:
            SamplingError: `objects` is out of range, or the house is too small for them.
        """
        return sample_episode(self.catalogue, self.navmesh, objects=objects, seed=seed)

    def known(self) -> KnownHouse:
        """What somebody knows of this house who was shown around."""
        return self._known

    @cached_property
    def _known(self) -> KnownHouse:
        # A fixed seed: viewpoints are a property of the house, not of a trial.
        rng = np.random.default_rng(0)
        floor = self.navmesh.sample(rng, VIEWPOINT_CANDIDATES)
        rooms = np.array(self.rooms.keys)[self.rooms.distances(floor).argmin(axis=1)]
        return KnownHouse(
            navmesh=self.navmesh,
            geodesics=self.geodesics,
            bins={key: r.center[:2] for key, r in self.receptacles.items()},
            approaches={key: self.navmesh.snap(r.approach) for key, r in self.receptacles.items()},
            viewpoints={
                key: spread_viewpoints(floor[rooms == key], VIEWPOINT_SPACING)
                for key in self.catalogue.rooms
                if np.any(rooms == key)
            },
        )
