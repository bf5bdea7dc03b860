"""Compiles this package's kernels ahead of the first episode; numba keeps them on disk for every later process.

Run once after installing: `python -m mjsim.warmup`.
"""

import math

from mjsim.actions import Move, Pick, Place
from mjsim.episode import Episode, PlacedObject, StartPose
from mjsim.model.catalogue import Catalogue
from mjsim.model.receptacles import receptacle_geometries
from mjsim.model.scene import Scene, compile_house, compose
from mjsim.options import FIDELITIES, WorldOptions
from mjsim.world import World

_TIERS = FIDELITIES


def compile_kernels(catalogue: Catalogue | None = None) -> None:
    """Walk, pick and place in every tier: every kernel runs on what it runs on later.

    Args:
        catalogue: House to do it in; the apartment by default.
    """
    scene = _errand(catalogue or Catalogue.load())
    for tier in _TIERS:
        world = World(scene, WorldOptions(fidelity=tier))
        for action in (Move(0.2, 0.1, 0.3, 0.1), Pick(), Move(-0.2), Place()):
            world.step(action)
            world.finish()
            world.walk([[0.1, 0.0, 0.1, 0.0]] * 3)


def _errand(catalogue: Catalogue) -> Scene:
    """Somebody before a receptacle, and an object for it half a metre behind."""
    key = next(iter(catalogue.receptacles))
    receptacle = receptacle_geometries(compile_house(catalogue), catalogue.receptacles)[key]
    x, y = receptacle.approach.tolist()
    heading = math.atan2(receptacle.center[1] - y, receptacle.center[0] - x)
    category = next(c for c in catalogue.categories.values() if c.receptacle == key)
    spot = (x - 0.5 * math.cos(heading), y - 0.5 * math.sin(heading))
    thing = PlacedObject(
        "thing", category.key, category.objects[0], spot, (*spot, 0.01), (1.0, 0.0, 0.0, 0.0)
    )
    keys = tuple(catalogue.receptacles)
    start = StartPose(x, y, heading)
    return compose(Episode(catalogue.name, 0, start, (thing,), keys, {thing.name: key}), catalogue)


if __name__ == "__main__":
    compile_kernels()
