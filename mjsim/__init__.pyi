from .environments.dm_environment import make as make
from .generator.home_cache import load_catalogue as load_catalogue
from .house.catalogue.catalogue import Catalogue as Catalogue
from .house.compiled.house import navigable_floor as navigable_floor
from .house.scene.disorder import Disorder as Disorder
from .house.scene.sampling import sample_episode as sample_episode
from .house.scene.scene import Scene as Scene, compose as compose
from .values.actions import (
    IDLE as IDLE,
    WAIT as WAIT,
    ActionResult as ActionResult,
    FollowPath as FollowPath,
    Move as Move,
    Pick as Pick,
    Place as Place,
    Refusal as Refusal,
    StepAction as StepAction,
    Stop as Stop,
    Wait as Wait,
)
from .values.episode import Episode as Episode
from .values.errors import MjsimError as MjsimError
from .values.observation import ObjectStatus as ObjectStatus, Observation as Observation
from .values.options import WorldOptions as WorldOptions
from .values.person_parameters import PersonParameters as PersonParameters
from .world.walking.polyline import path_length as path_length, point_along as point_along
from .world.walking.walker import Walker as Walker
from .world.world import StepResult as StepResult, World as World
