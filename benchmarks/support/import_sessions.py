"""Sessions in which imported objects are placed among those of the house."""

import contextlib
from pathlib import Path

import numpy as np

from benchmarks.support.mesh_files import MESHES
from benchmarks.support.placement_sessions import LEVELS, Placement, arrange, run_episode
from experiments.house import House
from mjsim.episode import Episode
from mjsim.errors import EpisodeError, SamplingError
from mjsim.importing.house_extension import Entry, HouseExtension
from mjsim.importing.mesh_import import add_mesh
from mjsim.model.catalogue import Category
from mjsim.model.scene import compose
from mjsim.options import WorldOptions

TIERS = ("full", "event")
OWN = LEVELS // 2  # imported objects of a session; the others are the house's
_SEED = 11
_ARRANGEMENTS = 100


def import_all(folder: Path) -> HouseExtension:
    """The apartment with all of `MESHES` imported into a folder."""
    for name, mesh in MESHES.items():
        entry = Entry.named(name, mesh.category)
        add_mesh(mesh.write(folder, name), HouseExtension(folder / "house"), entry, mesh.options)
    return HouseExtension(folder / "house")


def run_session(house: House, number: int, keys: tuple[str, ...]) -> list[tuple[str, Placement]]:
    """Place an imported object three times among three of the house's; the tier, and the imported object's tries."""
    tier, key = TIERS[number % len(TIERS)], keys[number // len(TIERS) % len(keys)]
    rng = np.random.default_rng([_SEED, number])
    category = house.catalogue.categories[house.catalogue.objects[key].category]
    others = [str(name) for name in rng.permutation([o for o in category.objects if o not in keys])]
    episode = _arrange(house, number, category, [key] * OWN + others[: LEVELS - OWN], rng)
    placements = run_episode(house, episode, WorldOptions(fidelity=tier))
    return [(tier, placement) for placement in placements if placement.model == key]


def _arrange(
    house: House, number: int, category: Category, models: list[str], rng: np.random.Generator
) -> Episode:
    """An arrangement in which no object overlaps another: long ones may reach into the next one's place.

    Raises:
        SamplingError: None is found.
    """
    for _ in range(_ARRANGEMENTS):
        episode = arrange(house, number, category, models, rng)
        with contextlib.suppress(EpisodeError):
            compose(episode, house.catalogue)
            return episode
    raise SamplingError(f"no arrangement of {', '.join(models)} without overlaps in {_ARRANGEMENTS} attempts")
