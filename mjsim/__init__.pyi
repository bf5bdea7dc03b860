from .environments.dm_environment import make
from .generator.home_cache import load_catalogue
from .house.catalogue.catalogue import Catalogue
from .house.compiled.house import navigable_floor
from .house.scene.disorder import Disorder
from .house.scene.sampling import sample_episode
from .house.scene.scene import Scene, compose
from .values.actions import (
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
from .values.episode import Episode
from .values.errors import MjsimError
from .values.observation import ObjectStatus, Observation
from .values.options import WorldOptions
from .values.person_parameters import PersonParameters
from .world.walking.polyline import path_length, point_along
from .world.walking.walker import Walker
from .world.world import StepResult, World

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
