"""Exceptions of `mjsim`, which are all derived from `MjsimError`."""

from typing import Any


class MjsimError(Exception):
    """Base class of all exceptions that `mjsim` raises. Messages explain how to correct the error."""


class AssetError(MjsimError):
    """Raised if a model, texture or catalogue entry is missing or malformed."""


class EpisodeError(MjsimError):
    """Raised if an episode file does not describe a valid episode."""


class HouseError(MjsimError):
    """Raised if a house cannot be generated, or if a recipe belongs to another generator version."""


class SamplingError(MjsimError):
    """Raised if no disorganized house that meets the constraints can be sampled."""


class ActionError(MjsimError):
    """Raised if an action contains invalid values. A refused action does not raise this error."""


class PersonError(MjsimError):
    """Raised if a parameter of a person is out of range."""


class PhysicsError(MjsimError):
    """Raised if MuJoCo issues a warning or the simulation state is not finite.

    Attributes:
        steps: Control steps of the action, as `mjsim.values.observation.Steps`. The last step has failed.
            None if the action had not started.
    """

    steps: Any = None


class StateError(MjsimError):
    """Raised if a saved state belongs to another world, or if a motion is in progress."""


class RenderError(MjsimError):
    """Raised if no OpenGL context can be created or a frame cannot be drawn."""


class EnvironmentConfigError(MjsimError):
    """Raised if an option of an environment is unknown or invalid."""


class EnvironmentStateError(MjsimError):
    """Raised if a method is called at the wrong time, for example `step` before the first `reset`."""


class ViewerError(MjsimError):
    """Raised if no window can be opened or dm-control is not installed."""


def brief(text: str, limit: int = 600) -> str:
    """Shorten a message to a single line of about `limit` characters."""
    line = " ".join(text.split())
    return line if len(line) <= limit else f"{line[: limit // 2]} ... {line[-limit // 2 :]}"
