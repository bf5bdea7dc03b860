"""Physics side of the rearrangement simulator: houses, episodes, world, observation and rendering.

Semantic versioning covers the names below, what their docstrings and `docs/` say of them, the command line, and the
files that it writes. Each is loaded at its first use; `import mjsim` loads none of the
simulator. The Gymnasium environment is `gymnasium.make("mjsim.environments:mjsim/Rearrange-v0")`.

    catalogue = mjsim.Catalogue.load("apartment")
    episode = mjsim.sample_episode(catalogue, objects=12, seed=3)
    world = mjsim.World(mjsim.compose(episode, catalogue))
    step = world.step(mjsim.Move(forward=1.0))
"""

from mjsim.support.lazy_names import lazy_names

TYPE_CHECKING = False  # as in `typing`, whose import would take most of the time of this one

__all__ = [
    "IDLE",
    "WAIT",
    "ActionResult",
    "Catalogue",
    "Disorder",
    "Episode",
    "FollowPath",
    "MjsimError",
    "Move",
    "ObjectStatus",
    "Observation",
    "PersonParameters",
    "Pick",
    "Place",
    "Refusal",
    "Scene",
    "StepAction",
    "StepResult",
    "Stop",
    "Wait",
    "Walker",
    "World",
    "WorldOptions",
    "compose",
    "load_catalogue",
    "make",
    "navigable_floor",
    "path_length",
    "point_along",
    "sample_episode",
]

if TYPE_CHECKING:
    from mjsim.environments.dm_environment import make
    from mjsim.generator.home_cache import load_catalogue
    from mjsim.house.catalogue.catalogue import Catalogue
    from mjsim.house.compiled.house import navigable_floor
    from mjsim.house.scene.disorder import Disorder
    from mjsim.house.scene.sampling import sample_episode
    from mjsim.house.scene.scene import Scene, compose
    from mjsim.values.actions import (
        IDLE,
        WAIT,
        ActionResult,
        FollowPath,
        Move,
        Pick,
        Place,
        Refusal,
        StepAction,
        Stop,
        Wait,
    )
    from mjsim.values.episode import Episode
    from mjsim.values.errors import MjsimError
    from mjsim.values.observation import ObjectStatus, Observation
    from mjsim.values.options import WorldOptions
    from mjsim.values.person_parameters import PersonParameters
    from mjsim.world.walking.polyline import path_length, point_along
    from mjsim.world.walking.walker import Walker
    from mjsim.world.world import StepResult, World
else:  # hidden from type checkers, which would otherwise accept any name
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "environments.dm_environment": ("make",),
            "generator.home_cache": ("load_catalogue",),
            "house.catalogue.catalogue": ("Catalogue",),
            "house.compiled.house": ("navigable_floor",),
            "house.scene.disorder": ("Disorder",),
            "house.scene.sampling": ("sample_episode",),
            "house.scene.scene": ("Scene", "compose"),
            "values.actions": (
                "IDLE",
                "WAIT",
                "ActionResult",
                "FollowPath",
                "Move",
                "Pick",
                "Place",
                "Refusal",
                "StepAction",
                "Stop",
                "Wait",
            ),
            "values.episode": ("Episode",),
            "values.errors": ("MjsimError",),
            "values.observation": ("ObjectStatus", "Observation"),
            "values.options": ("WorldOptions",),
            "values.person_parameters": ("PersonParameters",),
            "world.walking.polyline": ("path_length", "point_along"),
            "world.walking.walker": ("Walker",),
            "world.world": ("StepResult", "World"),
        },
    )
