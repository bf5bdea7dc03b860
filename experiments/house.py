"""A loaded house, with its catalogue, navmesh, geodesics, rooms and receptacles."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from experiments.errors import ConfigError
from hud.texts import HudTexts
from mjsim.generator.home_cache import load_catalogue
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.footprint import Footprint
from mjsim.house.compiled.house import compiled_house
from mjsim.house.compiled.sites import ReceptacleGeometry, RoomMap
from mjsim.house.compiled.standing import StandingPlaces
from mjsim.house.scene.disorder import Disorder
from mjsim.house.scene.sampling import house_points, sample_episode
from mjsim.house.validation.validate import require_usable
from mjsim.support.toml import read_toml
from mjsim.values.episode import POINTS, Episode
from mjsim.values.person_parameters import PersonParameters
from mjsim.world.walking.path_following import ARRIVED_WITHIN
from planner.geodesics import Geodesics
from planner.navmesh import NavMesh

TEXTS = Path(__file__).with_name("texts")  # folder with one TOML file per language
VIEWPOINT_SPACING = 2.2  # maximum distance from any point of a room to a viewpoint, in metres
VIEWPOINT_CANDIDATES = 3000
WALL_GAP = 0.05  # extra distance between planned paths and walls, in metres, so that people can cut corners


@dataclass(frozen=True, eq=False)
class House:
    """A house, with all data that its episodes have in common.

    Attributes:
        sampling_floor: Navmesh of the default person, on which objects and start positions are sampled for every
            person.
        navmesh: Navmesh of the person who walks in this house.
        geodesics: Shortest paths for planning and guidance, at a small distance from the walls. Objects may
            be off the navmesh if they are within reach of a path.
        receptacles: Geometry of each receptacle, by key.
        bounds: (x_min, y_min, x_max, y_max) of the floor, in metres.
        texts: HUD texts in the language of the catalogue's labels.
        seen: Keys of the receptacles that the participant has seen, or None if all are known.
    """

    catalogue: Catalogue
    sampling_floor: NavMesh
    navmesh: NavMesh
    geodesics: Geodesics
    rooms: RoomMap
    receptacles: Mapping[str, ReceptacleGeometry]
    bounds: tuple[float, float, float, float]
    person: PersonParameters
    texts: HudTexts
    seen: frozenset[str] | None = None

    @classmethod
    def load(cls, name: str = "apartment") -> "House":
        """Load a house by name and build the navmesh of the default person.

        Args:
            name: Name of a house in `models/houses`, path of a recipe, a `catalogue.toml` or its folder, or a generated
                home such as `generated:7`.

        Raises:
            AssetError: The house cannot be read or compiled, or violates a convention of docs/models.md.
            HouseError: The home cannot be generated.
        """
        return cls.of(load_catalogue(name))

    @classmethod
    def of(cls, catalogue: Catalogue) -> "House":
        """Prepare the house of a catalogue for trials. Raise an AssetError if the house cannot be used for trials."""
        house = compiled_house(catalogue)
        require_usable(house)
        floor = house.floor
        person = PersonParameters()
        navmesh = _navmesh(floor, person.body_radius + WALL_GAP)
        geodesics = Geodesics(navmesh, person.reach)
        standing = StandingPlaces.of(house, navmesh, person)
        return cls(
            catalogue,
            navmesh,
            navmesh,
            geodesics,
            house.rooms,
            {key: _usable(receptacle, standing) for key, receptacle in house.receptacles.items()},
            floor.bounds,
            person,
            HudTexts(**read_words()["hud"]),
        )

    def in_language(self, language: str, texts: HudTexts | None = None) -> "House":
        """Return a copy of this house in another language. `texts` replaces the HUD texts of that language.

        Raises:
            ConfigError: The language is not available.
            AssetError: A file with labels cannot be used.
        """
        texts = texts or HudTexts(**read_words(language)["hud"])
        catalogue = self.catalogue.in_language(language)
        rooms = dataclasses.replace(self.rooms, labels=catalogue.rooms)
        return dataclasses.replace(self, catalogue=catalogue, rooms=rooms, texts=texts)

    def for_person(self, person: PersonParameters) -> "House":
        """Return a copy of this house for a person of a different size or reach. Episodes do not change.

        Raises:
            ConfigError: A receptacle would be out of reach.
        """
        usual, size = PersonParameters(), (person.body_radius, person.reach)
        if size == (self.person.body_radius, self.person.reach):
            return self
        navmesh = self.sampling_floor
        if person.body_radius != usual.body_radius:
            navmesh = _navmesh(compiled_house(self.catalogue).floor, person.body_radius + WALL_GAP)
        house = dataclasses.replace(
            self, navmesh=navmesh, geodesics=Geodesics(navmesh, person.reach), person=person
        )
        for key, receptacle in house.receptacles.items():
            needed = receptacle.distance(house.approaches[key]) + ARRIVED_WITHIN
            if needed > person.reach:
                raise ConfigError(
                    f"a reach of {person.reach:.2f} m is too short for {key!r}, which needs {needed:.2f} m"
                )
        return house

    @cached_property
    def body_geodesics(self) -> Geodesics:
        """Shortest paths that may touch the walls. Their lengths are lower bounds on walking distances."""
        floor = compiled_house(self.catalogue).floor
        return Geodesics(_navmesh(floor, self.person.body_radius))

    @cached_property
    def standing(self) -> StandingPlaces:
        """The places where the person can stand to pick up or place an object."""
        return StandingPlaces.of(compiled_house(self.catalogue), self.navmesh, self.person)

    def place_of(self, point: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the place, in metres, to which a person walks to pick up an object at a point (2,).

        This is the point itself, unless the reach from the nearest navigable place is not free.
        """
        if self.navmesh.is_navigable(point):
            return point
        place = self.standing.instead_of(self.navmesh.snap(point, math.inf), point)
        return point if place is None else place

    @cached_property
    def approaches(self) -> Mapping[str, NDArray[np.float64]]:
        """Navigable points from which receptacles can be used, by receptacle key, in metres, shape (2,)."""
        return {key: self.navmesh.snap(r.approach) for key, r in self.receptacles.items()}

    @cached_property
    def viewpoints(self) -> Mapping[str, NDArray[np.float64]]:
        """Points that together give a view of the whole room, by room key, in metres, shape (k, 2)."""
        # Use a fixed seed so that the viewpoints are the same in all trials in the house.
        floor = self.navmesh.sample(np.random.default_rng(0), VIEWPOINT_CANDIDATES)
        rooms = np.array(self.rooms.keys)[self.rooms.distances(floor).argmin(axis=1)]
        return {
            key: _farthest_points(floor[rooms == key], VIEWPOINT_SPACING)
            for key in self.catalogue.rooms
            if np.any(rooms == key)
        }

    def sample_episode(
        self, *, objects: int, seed: int, points: int = POINTS, disorder: Disorder | None = None
    ) -> Episode:
        """Sample an episode, in which objects are misplaced at random (PAPER section 4).

        Raises:
            SamplingError: `objects` is out of range, or the house is too small for the number of points.
        """
        floor = self.sampling_floor
        return sample_episode(
            self.catalogue, floor, objects=objects, seed=seed, points=points, disorder=disorder
        )

    def sample_points(self, *, seed: int, points: int = POINTS) -> NDArray[np.float64]:
        """Sample points at which objects can be placed, in metres, shape (points, 2).

        Raises:
            SamplingError: The house is too small for the number of points.
        """
        return house_points(self.catalogue, self.sampling_floor, seed=seed, points=points)


def read_words(language: str = "en") -> Mapping[str, Mapping[str, Any]]:
    """Return all texts in a language, grouped by section.

    Raises:
        ConfigError: The language is not available.
    """
    path = TEXTS / f"{language}.toml"
    if not path.is_file():
        known = ", ".join(sorted(file.stem for file in TEXTS.glob("*.toml")))
        raise ConfigError(f"no texts in language {language!r}; there are {known}")
    return msgspec.convert(read_toml(path), dict[str, dict[str, Any]])


def _navmesh(floor: Footprint, radius: float) -> NavMesh:
    return NavMesh.build(floor.obstacles, floor.bounds, agent_radius=radius)


def _usable(receptacle: ReceptacleGeometry, standing: StandingPlaces) -> ReceptacleGeometry:
    """Move the approach of a receptacle if it is in a doorway or the reach is not free."""
    place = standing.instead_of(standing.navigable.snap(receptacle.approach, math.inf), receptacle)
    return receptacle if place is None else dataclasses.replace(receptacle, approach=place)


def _farthest_points(points: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """Sample points (m, 2) farthest-first until every point has a sampled point within `spacing` metres."""
    chosen = [int(np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    gap = np.linalg.norm(points - points[chosen[0]], axis=1)
    while gap.max() > spacing:
        farthest = int(np.argmax(gap))
        chosen.append(farthest)
        gap = np.minimum(gap, np.linalg.norm(points - points[farthest], axis=1))
    return points[chosen]
