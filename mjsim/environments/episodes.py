"""Where an environment's episodes come from, compiled once and kept while they may be needed again."""

from collections import OrderedDict
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from mjsim.environments.dm_physics import physics_of
from mjsim.environments.errors import EnvironmentConfigError
from mjsim.environments.layout import HouseKit
from mjsim.episode import Episode
from mjsim.model.sampling import sample_episode
from mjsim.model.scene import compose
from mjsim.options import WorldOptions
from mjsim.render import Labels, Renderer
from mjsim.world import World

_LEVEL = 41  # keeps the choice of a level apart from what the seed decides in the house


class Stage:
    """A compiled episode with the renderers that drew it.

    Attributes:
        world: The running episode.
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self._renderers: dict[tuple[int, int, str], Renderer] = {}

    def renderer(self, width: int, height: int, profile: str) -> Renderer:
        """A renderer of this size, made on first use.

        Raises:
            RenderError: No OpenGL context could be made.
        """
        key = width, height, profile
        if key not in self._renderers:
            self._renderers[key] = Renderer(self.world.model, width=width, height=height, profile=profile)
        return self._renderers[key]

    @cached_property
    def labels(self) -> Labels:
        """What the episode's geoms belong to."""
        return Labels.of(self.world.scene)

    @cached_property
    def physics(self) -> Any:
        """The same state as a `dm_control.mujoco.Physics`, for dm_control's tools."""
        return physics_of(self.world)

    def close(self) -> None:
        """Free the GL resources; again does nothing."""
        while self._renderers:
            self._renderers.popitem()[1].close()


class EpisodeSource:
    """Seed -> running episode; the same seed gives the same episode, whatever came before.

    Args:
        kit: The house.
        objects: How many objects, or the least and the most.
        episodes: None for a new house per seed; a number for that many houses, seeds counted modulo it; or
            episodes sampled before, chosen by the seed modulo their number.
        options: Rules of the world.
        keep: How many compiled episodes are kept, about 20 MB each.
    """

    def __init__(
        self,
        kit: HouseKit,
        *,
        objects: tuple[int, int],
        episodes: int | Sequence[Episode] | None,
        options: WorldOptions,
        keep: int,
    ) -> None:
        self._kit = kit
        self._objects = objects
        self._given = None if episodes is None or isinstance(episodes, int) else tuple(episodes)
        self._count = episodes if isinstance(episodes, int) else len(self._given) if self._given else None
        self._options = options
        self._keep = keep
        self._stages: OrderedDict[int, Stage] = OrderedDict()

    def stage(self, seed: int) -> Stage:
        """The episode of a seed, not yet reset.

        Raises:
            SamplingError: The house has no room for this seed's objects.
            AssetError: A model is malformed.
        """
        key = seed if self._count is None else seed % self._count
        if key not in self._stages:
            while len(self._stages) >= self._keep:
                self._stages.popitem(last=False)[1].close()
            self._stages[key] = Stage(World(compose(self.episode(seed), self._kit.catalogue), self._options))
        self._stages.move_to_end(key)
        return self._stages[key]

    def episode(self, seed: int) -> Episode:
        """The episode that a seed stands for.

        Raises:
            SamplingError: The house has no room for this seed's objects.
        """
        key = seed if self._count is None else seed % self._count
        if self._given is not None:
            return self._given[key]
        if self._kit.navigable is None:
            raise EnvironmentConfigError(
                "this house was loaded without a navigable floor; load it with sampling=True"
            )
        low, high = self._objects
        level = int(np.random.default_rng([key, _LEVEL]).integers(low, high + 1))
        return sample_episode(self._kit.catalogue, self._kit.navigable, objects=level, seed=key)

    def close(self) -> None:
        """Let go of all compiled episodes; they are made anew when asked for."""
        while self._stages:
            self._stages.popitem()[1].close()
