"""Exceptions of `mjsim`, all derived from `MjsimError`. Messages state how to correct the error."""

from typing import Any


class MjsimError(Exception):
    """Base of every error raised by :mod:`mjsim`."""


class AssetError(MjsimError):
    """A model, texture or catalogue entry is missing or malformed."""


class EpisodeError(MjsimError):
    """An episode file does not describe a valid episode."""


class HouseError(MjsimError):
    """No house can be generated as requested, or a recipe belongs to another version of the generator."""


class SamplingError(MjsimError):
    """No disorganized house satisfies the constraints."""


class ActionError(MjsimError):
    """An action contains invalid values. A refused action does not raise this error."""


class PersonError(MjsimError):
    """A parameter of a person is out of range."""


class PhysicsError(MjsimError):
    """MuJoCo issued a warning, or the simulation state is not finite.

    Attributes:
        steps: Control steps of the action (`mjsim.values.observation.Steps`), the last of which failed. None if the
            action had not started.
    """

    steps: Any = None


class StateError(MjsimError):
    """A saved state belongs to another world, or a motion is in progress."""


class RenderError(MjsimError):
    """No OpenGL context could be created, or a frame cannot be drawn."""


class EnvironmentConfigError(MjsimError):
    """An option of the environment is unknown or invalid."""


class EnvironmentStateError(MjsimError):
    """A method was called at the wrong time, for example `step` before the first reset."""


class ViewerError(MjsimError):
    """No window could be opened, or dm-control is not installed."""


def brief(text: str, limit: int = 600) -> str:
    """Shorten a message to one line of about `limit` characters."""
    line = " ".join(text.split())
    return line if len(line) <= limit else f"{line[: limit // 2]} ... {line[-limit // 2 :]}"
