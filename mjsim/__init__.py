"""Physics side of the rearrangement simulator: houses, episodes, world, observation and rendering.

Semantic versioning covers the names below, what their docstrings and `docs/` say of them, the command line, and the
files that it writes. Each is loaded at its first use; `import mjsim` loads none of the
simulator. The Gymnasium environment is `gymnasium.make("mjsim.environments:mjsim/Rearrange-v0")`.

    catalogue = mjsim.Catalogue.load("apartment")
    episode = mjsim.sample_episode(catalogue, objects=12, seed=3)
    world = mjsim.World(mjsim.compose(episode, catalogue))
    step = world.step(mjsim.Move(forward=1.0))
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
