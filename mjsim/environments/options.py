"""Options for creating a rearrangement environment."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import partial
from numbers import Real
from typing import Any, Literal, TypeVar

from mjsim.environments.control import CONTROLS, Control
from mjsim.environments.core import Rearrangement
from mjsim.environments.episodes import EpisodeCache, sample
from mjsim.environments.rewards import REWARDS, RewardFunction
from mjsim.environments.sensors import Sensor, resolve_sensors
from mjsim.environments.sensors.base import CameraOptions, ObservationLayout
from mjsim.generator.home_cache import load_catalogue
from mjsim.house.compiled.house import NavigableBuilder, compiled_house, navigable_floor
from mjsim.values.episode import POINTS, Episode
from mjsim.values.errors import EnvironmentConfigError
from mjsim.values.options import WorldOptions
from mjsim.values.person_parameters import PersonParameters

T = TypeVar("T")

SECONDS_PER_OBJECT = 60.0
DEFAULT_CACHE_SIZE = 8  # default number of compiled episodes in the cache
MAX_SLOTS = 1000  # maximum number of rows in per-object arrays


@dataclass(frozen=True, eq=False)
class EnvironmentOptions:
    """Options that `mjsim.make` and `gymnasium.make` accept.

    Attributes:
        house: Name of a folder under `models/houses`, or the path of a `catalogue.toml` file or its folder.
        objects: Number of misplaced objects, or (min, max) to draw a random number for each episode.
        observations: Names of sensors or bundles, or custom `Sensor` values (docs/environments.md).
        actions: `continuous`, `discrete` or a custom `Control`.
        reward: `time`, `shaped` or a custom function.
        time_limit: Simulated time in seconds after which an episode is truncated, by default 60 s per object.
        episodes: None to sample a new episode at every reset, or N to reuse N sampled episodes, which makes
            resets faster, or a list of episodes to use.
        slots: Number of rows in per-object arrays, by default the maximum number of objects in an episode.
        camera: Options of the eye camera's images.
        person: Parameters of the person.
        world: Options of the world.
        keep: Number of compiled episodes in the cache, each of about 20 MB. The default is `episodes` if that
            is a number, otherwise 8.
        physics_errors: `raise` to raise physics errors, or `truncate` to end the episode so that training
            continues. A truncated episode repeats its last valid observation, and `info["physics_error"]`
            contains the error.
        navigable: Function that computes the walkable floor. By default, the installed function is used.

    Raises:
        EnvironmentConfigError: A value is out of range.
    """

    house: str = "apartment"
    objects: int | tuple[int, int] = 6
    observations: Sequence[str | Sensor] = ("state",)
    actions: str | Control = "continuous"
    reward: str | RewardFunction = "time"
    time_limit: float | None = None
    episodes: int | Sequence[Episode] | None = None
    slots: int | None = None
    camera: CameraOptions = field(default_factory=CameraOptions)
    person: PersonParameters = field(default_factory=PersonParameters)
    world: WorldOptions = field(default_factory=WorldOptions)
    keep: int | None = None
    physics_errors: Literal["raise", "truncate"] = "raise"
    navigable: NavigableBuilder | None = None

    def __post_init__(self) -> None:
        _check_types(self)
        counts = self.objects if isinstance(self.objects, tuple | list) else (self.objects, self.objects)
        others = [value for value in (self.time_limit, self.slots, self.keep) if value is not None]
        whole = len(counts) == 2 and all(type(count) is int for count in counts)
        if not whole or not all(isinstance(number, Real) for number in others):
            raise EnvironmentConfigError(
                "objects must be a whole number or (min, max), and time_limit, slots and keep numbers or None; got "
                f"{self.objects!r}, {self.time_limit!r}, {self.slots!r} and {self.keep!r}"
            )
        low, high = self.object_range
        limit, episodes = self.time_limit, self.episodes
        count = 1 if episodes is None else episodes if isinstance(episodes, int) else len(episodes)
        for is_valid, message in (
            (1 <= low <= high, f"objects must be at least 1, min before max; got {self.objects!r}"),
            (
                isinstance(episodes, Sequence) or high <= POINTS,
                f"objects is {self.objects!r}; a house has {POINTS} points for objects",
            ),
            (
                self.slots is None or self.slots <= MAX_SLOTS,
                f"slots is {self.slots}; it must be at most {MAX_SLOTS}",
            ),
            (
                limit is None or (math.isfinite(limit) and limit > 0),
                f"time_limit must be a positive number of seconds, got {limit}",
            ),
            (count > 0, "episodes is empty; give at least one, or None to sample new ones"),
            (self.keep is None or self.keep > 0, f"keep must be at least 1, got {self.keep}"),
            (
                self.physics_errors in ("raise", "truncate"),
                f"physics_errors must be 'raise' or 'truncate', got {self.physics_errors!r}",
            ),
            (
                self.slots is None or self.slots >= high,
                f"slots is {self.slots}, but an episode may have {high} objects",
            ),
        ):
            if not is_valid:
                raise EnvironmentConfigError(message)

    @property
    def object_range(self) -> tuple[int, int]:
        """The minimum and maximum number of objects in an episode."""
        if isinstance(self.episodes, Sequence) and self.episodes:
            counts = [len(e.objects) for e in self.episodes]
            return min(counts), max(counts)
        return (self.objects, self.objects) if isinstance(self.objects, int) else self.objects


def _check_types(options: EnvironmentOptions) -> None:
    episodes, made = options.episodes, options.actions
    several = isinstance(episodes, Sequence) and all(isinstance(one, Episode) for one in episodes)
    for name, fits, wanted in (
        ("house", isinstance(options.house, str), "a name or a path as text"),
        (
            "observations",
            isinstance(options.observations, str | list | tuple),
            "names of sensors, or Sensors",
        ),
        ("actions", isinstance(made, str) or hasattr(made, "steps"), "a name or a Control"),
        ("reward", isinstance(options.reward, str) or callable(options.reward), "a name or a function"),
        ("episodes", type(episodes) in (int, type(None)) or several, "None, a number or Episodes"),
        ("camera", isinstance(options.camera, CameraOptions), "CameraOptions"),
        ("person", isinstance(options.person, PersonParameters), "PersonParameters"),
        ("world", isinstance(options.world, WorldOptions), "WorldOptions"),
        ("navigable", options.navigable is None or callable(options.navigable), "None or a function"),
    ):
        if not fits:
            raise EnvironmentConfigError(f"{name} must be {wanted}; got {getattr(options, name)!r:.200}")


def parse_options(given: dict[str, Any]) -> EnvironmentOptions:
    """Create options from keyword arguments. Raise an EnvironmentConfigError if one is unknown or invalid."""
    known = [f.name for f in fields(EnvironmentOptions)]
    unknown = sorted(set(given) - set(known))
    if unknown:
        raise EnvironmentConfigError(f"an environment has no option {unknown[0]!r}; it has {known}")
    return EnvironmentOptions(**given)


def build(options: EnvironmentOptions) -> Rearrangement:
    """Load the house, and create a rearrangement task with the given options.

    Raises:
        EnvironmentConfigError: The name of a sensor, control or reward is unknown.
        SamplingError: No package that computes the walkable floor is installed.
        AssetError: The house is malformed.
    """
    sensors = resolve_sensors(options.observations)
    control = _named(CONTROLS, options.actions, "actions")
    reward = _named(REWARDS, options.reward, "reward")
    catalogue = load_catalogue(options.house)
    floor = compiled_house(catalogue).floor
    make: Callable[[int], Episode]
    count: int | None
    if isinstance(options.episodes, Sequence):
        make, count, cache_size = options.episodes.__getitem__, len(options.episodes), DEFAULT_CACHE_SIZE
    else:
        build_floor = options.navigable
        navigable = build_floor(floor.obstacles, floor.bounds) if build_floor else navigable_floor(catalogue)
        if not hasattr(navigable, "sample"):
            raise EnvironmentConfigError(
                f"navigable returned {navigable!r:.200}; it must return a NavigableFloor"
            )
        make = partial(sample, catalogue, navigable, options.object_range)
        count, cache_size = options.episodes, options.episodes or DEFAULT_CACHE_SIZE
    max_objects = options.object_range[1]
    layout = ObservationLayout(
        slots=options.slots or max_objects,
        categories=tuple(catalogue.categories),
        receptacles=tuple(catalogue.receptacles),
        floor=floor,
        camera=options.camera,
        max_speed=options.person.fastest_walk,
        time_limit=options.time_limit or SECONDS_PER_OBJECT * max_objects,
    )
    return Rearrangement(
        EpisodeCache(
            catalogue,
            make,
            count=count,
            options=options.world,
            person=options.person,
            size=options.keep or cache_size,
        ),
        layout,
        sensors=sensors,
        control=control,
        reward=reward,
        rebuild=partial(build, options),
        truncate_on_physics_error=options.physics_errors == "truncate",
    )


def _named(choices: Mapping[str, T], given: str | T, option: str) -> T:
    if not isinstance(given, str):
        return given
    if given not in choices:
        raise EnvironmentConfigError(
            f"no {option} {given!r}; choose from {sorted(choices)}, or pass a custom value"
        )
    return choices[given]
