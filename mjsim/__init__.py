"""Physics side of the rearrangement simulator: houses, episodes, world, observation and rendering.

Importing it registers the Gymnasium environment `mjsim/Rearrange-v0` by name, and loads none of the simulator.
"""

from typing import TYPE_CHECKING, Any

from mjsim.environments.registration import register_environments

if TYPE_CHECKING:
    from mjsim.environments.dm_environment import make

__all__ = ["make"]

register_environments()


def __getattr__(name: str) -> Any:
    if name == "make":
        from mjsim.environments.dm_environment import make

        return make
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
