"""Physics side of the rearrangement simulator: houses, episodes, world, observation and rendering.

The names below are the public surface: semantic versioning covers them, what their docstrings and `docs/` say of them,
the command line, and the files that it writes. Each is loaded at its first use; `import mjsim` loads none of the
simulator. The Gymnasium environment is `gymnasium.make("mjsim.environments:mjsim/Rearrange-v0")`.

    catalogue = mjsim.Catalogue.load("apartment")
    episode = mjsim.sample_episode(catalogue, objects=12, seed=3)
    world = mjsim.World(mjsim.compose(episode, catalogue))
    step = world.step(mjsim.Move(forward=1.0))
"""

TYPE_CHECKING = False  # as in `typing`, whose import would take most of the time of this one

__all__ = [
    "IDLE",
    "ActionResult",
    "Catalogue",
    "Episode",
    "FollowPath",
    "MjsimError",
    "Move",
    "Observation",
    "PersonParameters",
    "Pick",
    "Place",
    "Refusal",
    "Scene",
    "StepResult",
    "Stop",
    "Wait",
    "World",
    "WorldOptions",
    "compose",
    "load_catalogue",
    "make",
    "navigable_floor",
    "sample_episode",
]

if TYPE_CHECKING:
    from mjsim.environments.dm_environment import make
    from mjsim.generator.home_cache import load_catalogue
    from mjsim.house.catalogue.catalogue import Catalogue
    from mjsim.house.compiled.house import navigable_floor
    from mjsim.house.scene.sampling import sample_episode
    from mjsim.house.scene.scene import Scene, compose
    from mjsim.values.actions import IDLE, ActionResult, FollowPath, Move, Pick, Place, Refusal, Stop, Wait
    from mjsim.values.episode import Episode
    from mjsim.values.errors import MjsimError
    from mjsim.values.observation import Observation
    from mjsim.values.options import WorldOptions
    from mjsim.values.person_parameters import PersonParameters
    from mjsim.world.world import StepResult, World
else:  # hidden from type checkers, which would otherwise accept any name
    _MODULES = {
        "values.actions": (
            "IDLE",
            "ActionResult",
            "FollowPath",
            "Move",
            "Pick",
            "Place",
            "Refusal",
            "Stop",
            "Wait",
        ),
        "environments.dm_environment": ("make",),
        "values.episode": ("Episode",),
        "values.errors": ("MjsimError",),
        "generator.home_cache": ("load_catalogue",),
        "house.catalogue.catalogue": ("Catalogue",),
        "house.compiled.house": ("navigable_floor",),
        "house.scene.sampling": ("sample_episode",),
        "house.scene.scene": ("Scene", "compose"),
        "values.observation": ("Observation",),
        "values.options": ("WorldOptions",),
        "values.person_parameters": ("PersonParameters",),
        "world.world": ("StepResult", "World"),
    }

    def __getattr__(name):
        import importlib

        for module, names in _MODULES.items():
            if name in names:
                return getattr(importlib.import_module(f"mjsim.{module}"), name)
        raise AttributeError(f"module 'mjsim' has no attribute {name!r}; its public names are {__all__}")

    def __dir__():
        return sorted({*globals(), *__all__})
