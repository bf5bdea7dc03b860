"""Everything that decides what an environment is, and the making of its core."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Literal

from mjsim.environments.control import Control, resolve_control
from mjsim.environments.core import Rearrangement
from mjsim.environments.episodes import EpisodeSource
from mjsim.environments.errors import EnvironmentConfigError
from mjsim.environments.layout import CameraOptions, HouseKit, Layout
from mjsim.environments.navigable import NavigableBuilder
from mjsim.environments.rewards import RewardFunction, resolve_reward
from mjsim.environments.sensors import Sensor, resolve_sensors
from mjsim.episode import Episode
from mjsim.options import WorldOptions

SECONDS_PER_OBJECT = 60.0


@dataclass(frozen=True, eq=False)
class EnvironmentOptions:
    """What both `mjsim.make` and `gymnasium.make` take.

    Attributes:
        house: Name under `models/houses`, or the path of a `catalogue.toml`.
        objects: How many misplaced objects; a pair for the least and the most, drawn per episode.
        observations: Names of sensors or bundles, or sensors of your own (docs/environments.md).
        actions: `continuous`, `discrete` or a control of your own.
        reward: `time`, `shaped` or a function of your own.
        time_limit: Simulated time after which an episode is cut off, s; None for 60 s per object.
        episodes: None for a new house per episode; a number for so many houses that come again and again, which
            makes resets quick; or episodes that were sampled before.
        slots: Objects that the arrays have room for; None for the most that `objects` or `episodes` have.
        camera: The eye camera's images.
        world: Limits of walking, reach and grip.
        keep: How many compiled episodes are kept, about 20 MB each; None for all of a number of `episodes`, else 8.
        physics_errors: `raise`, or `truncate` to let training go on: a failure of the physics then cuts the episode
            off, with the last sound observation and `info["physics_error"]`.
        navigable: Works out where one can walk; None for the installed one.
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
    world: WorldOptions = field(default_factory=WorldOptions)
    keep: int | None = None
    physics_errors: Literal["raise", "truncate"] = "raise"
    navigable: NavigableBuilder | None = None

    def __post_init__(self) -> None:
        low, high = self.levels
        if not 1 <= low <= high:
            raise EnvironmentConfigError(
                f"objects must be at least 1, least before most; got {self.objects!r}"
            )
        if self.time_limit is not None and not (math.isfinite(self.time_limit) and self.time_limit > 0):
            raise EnvironmentConfigError(
                f"time_limit must be a positive number of seconds, got {self.time_limit}"
            )
        if self.episodes is not None and not (
            self.episodes > 0 if isinstance(self.episodes, int) else len(self.episodes)
        ):
            raise EnvironmentConfigError(
                "episodes is empty; give at least one, or None to sample without end"
            )
        if self.keep is not None and self.keep < 1:
            raise EnvironmentConfigError(f"keep must be at least 1, got {self.keep}")
        if self.physics_errors not in ("raise", "truncate"):
            raise EnvironmentConfigError(
                f"physics_errors must be 'raise' or 'truncate', got {self.physics_errors!r}"
            )
        if self.slots is not None and self.slots < high:
            raise EnvironmentConfigError(f"slots is {self.slots}, but an episode may have {high} objects")

    @property
    def levels(self) -> tuple[int, int]:
        """The least and the most objects of an episode."""
        if isinstance(self.episodes, Sequence) and self.episodes:
            counts = [len(e.objects) for e in self.episodes]
            return min(counts), max(counts)
        return (self.objects, self.objects) if isinstance(self.objects, int) else self.objects

    @property
    def kept(self) -> int:
        """How many compiled episodes are kept."""
        if self.keep is not None:
            return self.keep
        return self.episodes if isinstance(self.episodes, int) else 8


def parse_options(given: dict[str, Any]) -> EnvironmentOptions:
    """Options from keyword arguments.

    Raises:
        EnvironmentConfigError: An unknown name, or an unusable value.
    """
    known = [f.name for f in fields(EnvironmentOptions)]
    unknown = sorted(set(given) - set(known))
    if unknown:
        raise EnvironmentConfigError(f"an environment has no option {unknown[0]!r}; it has {known}")
    return EnvironmentOptions(**given)


def build(options: EnvironmentOptions) -> Rearrangement:
    """Make the core: read the house, work out where one can walk, put sensors, control and reward together.

    Raises:
        EnvironmentConfigError: A name is unknown, or no navigable floor can be made.
        AssetError: The house is malformed.
    """
    sensors = resolve_sensors(options.observations)
    control, reward = resolve_control(options.actions), resolve_reward(options.reward)
    given = isinstance(options.episodes, Sequence)
    kit = HouseKit.load(options.house, sampling=not given, builder=options.navigable)
    most = options.levels[1]
    layout = Layout(
        slots=options.slots or most,
        categories=tuple(kit.catalogue.categories),
        receptacles=tuple(kit.catalogue.receptacles),
        floor=kit.floor,
        camera=options.camera,
        max_speed=options.world.max_speed,
        time_limit=options.time_limit or SECONDS_PER_OBJECT * most,
    )
    source = EpisodeSource(
        kit,
        objects=options.levels,
        episodes=options.episodes,
        options=options.world,
        keep=options.kept,
    )
    return Rearrangement(
        source,
        layout,
        sensors=sensors,
        control=control,
        reward=reward,
        forgiving=options.physics_errors == "truncate",
    )
