"""Sample, compile and cache the episodes of an environment."""

from collections import OrderedDict
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.house import NavigablePoints
from mjsim.house.scene.sampling import sample_episode
from mjsim.house.scene.scene import compose
from mjsim.render import Labels, Renderer
from mjsim.render.diagnostics import INSTALL_DM_CONTROL
from mjsim.values.episode import Episode
from mjsim.values.errors import ViewerError
from mjsim.values.options import WorldOptions
from mjsim.values.person_parameters import PersonParameters
from mjsim.world.world import World

_COUNT_STREAM = 41  # index of the random stream for the number of objects


class CompiledEpisode:
    """A compiled episode together with its renderers."""

    def __init__(self, world: World) -> None:
        self.world = world
        self._renderers: dict[tuple[int, int, str], Renderer] = {}

    def renderer(self, width: int, height: int, profile: str) -> Renderer:
        """Return the renderer for an image size in pixels and a render profile. Create it on first use."""
        key = width, height, profile
        if key not in self._renderers:
            self._renderers[key] = Renderer(self.world.model, width=width, height=height, profile=profile)
        return self._renderers[key]

    @cached_property
    def labels(self) -> Labels:
        return Labels.of(self.world.scene)

    @cached_property
    def physics(self) -> Any:
        """The state of the world as a `dm_control.mujoco.Physics` object."""
        return dm_control_physics(self.world)

    def close(self) -> None:
        """Free the OpenGL resources. Repeated calls have no effect."""
        while self._renderers:
            self._renderers.popitem()[1].close()


def dm_control_physics(world: World) -> Any:
    """Return the state of a world as a `dm_control.mujoco.Physics` object, which must not be modified.

    Raises:
        ViewerError: dm-control is not installed.
    """
    # Importing dm_control fixes the OpenGL backend of the process, so it is imported only when needed.
    try:
        from dm_control import mujoco as dm_mujoco
    except ModuleNotFoundError as error:
        raise ViewerError(f"dm-control is not installed ({error}): {INSTALL_DM_CONTROL}") from error

    return dm_mujoco.Physics(dm_mujoco.wrapper.MjData(world.data))


def sample(catalogue: Catalogue, navigable: NavigablePoints, objects: tuple[int, int], seed: int) -> Episode:
    """Sample the episode for a seed. `objects` holds the minimum and maximum number of objects."""
    low, high = objects
    count = int(np.random.default_rng([seed, _COUNT_STREAM]).integers(low, high + 1))
    return sample_episode(catalogue, navigable, objects=count, seed=seed)


class EpisodeCache:
    """A cache of compiled episodes by seed. A seed always gives the same episode.

    If `count` is given, seeds are taken modulo `count`. The cache holds at most `size` episodes (20 MB each).
    """

    def __init__(
        self,
        catalogue: Catalogue,
        make: Callable[[int], Episode],
        *,
        count: int | None,
        options: WorldOptions,
        person: PersonParameters,
        size: int,
    ) -> None:
        self._catalogue, self._make, self._count = catalogue, make, count
        self._options, self._person, self._size = options, person, size
        self._compiled: OrderedDict[int, CompiledEpisode] = OrderedDict()

    def get(self, seed: int) -> CompiledEpisode:
        """Return the compiled episode for a seed. The caller must reset its world before use."""
        key = seed if self._count is None else seed % self._count
        if key not in self._compiled:
            while len(self._compiled) >= self._size:
                self._compiled.popitem(last=False)[1].close()
            scene = compose(self._make(key), self._catalogue, person=self._person)
            self._compiled[key] = CompiledEpisode(World(scene, self._options))
        self._compiled.move_to_end(key)
        return self._compiled[key]

    def close(self) -> None:
        """Free all compiled episodes. `get` compiles an episode again when it is needed."""
        while self._compiled:
            self._compiled.popitem()[1].close()
