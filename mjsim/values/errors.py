"""Typed errors of the physics side.

    MjsimError
    ├── AssetError        a model, texture or catalogue entry is missing or malformed
    ├── EpisodeError      an episode file does not describe a valid episode
    ├── HouseError        no house can be generated of this seed or recipe
    ├── SamplingError     no disorganized house satisfies the constraints
    ├── ActionError       an action's numbers are unusable (a refusal is not an error)
    ├── PersonError       a value of a person is out of range
    ├── PhysicsError      MuJoCo warned, or a state is not finite
    ├── StateError        a saved state does not fit the world, or the world is in the middle of a motion
    ├── RenderError       no GL context, or a frame cannot be drawn
    ├── EnvironmentConfigError, EnvironmentStateError   an option, or a call at this moment, is unusable
    └── ViewerError       no window could be opened, or dm-control is not installed

Every message names the offending value and what to do about it.
"""

from typing import Any


class MjsimError(Exception):
    """Base of every error raised by :mod:`mjsim`."""


class AssetError(MjsimError):
    """A model, texture or catalogue entry is missing or malformed."""


class EpisodeError(MjsimError):
    """An episode file does not describe a valid episode."""


class HouseError(MjsimError):
    """No house can be generated as asked, or a recipe is of another generator."""


class SamplingError(MjsimError):
    """No disorganized house satisfies the constraints."""


class ActionError(MjsimError):
    """An action's numbers are unusable."""


class PersonError(MjsimError):
    """A value of a person is out of range."""


class PhysicsError(MjsimError):
    """MuJoCo warned, or a state is not finite.

    Attributes:
        steps: Control steps of the action (`mjsim.values.observation.Steps`), the last of which failed. None if the
            action had not started.
    """

    steps: Any = None


class StateError(MjsimError):
    """A saved state does not fit the world, or the world is in the middle of a motion."""


class RenderError(MjsimError):
    """No GL context could be made, or a frame cannot be drawn."""


class EnvironmentConfigError(MjsimError):
    """An option of the environment is unknown or unusable."""


class EnvironmentStateError(MjsimError):
    """A call is not possible now, such as a step before the first reset."""


class ViewerError(MjsimError):
    """No window could be opened, or dm-control is not installed."""


def brief(text: str, limit: int = 600) -> str:
    """A message as one line of at most `limit` characters: whatever a file holds, its error can be read."""
    line = " ".join(text.split())
    return line if len(line) <= limit else f"{line[: limit // 2]} ... {line[-limit // 2 :]}"
