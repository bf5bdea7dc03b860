"""A simulator for household rearrangement, with houses, episodes, physics, observations and rendering.

Semantic versioning applies to the public names of this package, to the command line, and to its output files.
Names are loaded on first use, so that `import mjsim` is fast.
The Gymnasium environment is created by `gymnasium.make("mjsim.environments:mjsim/Rearrange-v0")`.

    catalogue = mjsim.Catalogue.load("apartment")
    episode = mjsim.sample_episode(catalogue, objects=12, seed=3)
    world = mjsim.World(mjsim.compose(episode, catalogue))
    step = world.step(mjsim.Move(forward=1.0))
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
