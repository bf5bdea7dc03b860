"""Errors of the environments, below the base of all of mjsim's errors."""

from mjsim.errors import MjsimError


class EnvironmentConfigError(MjsimError):
    """An environment was asked for something that it cannot be made of."""


class EnvironmentStateError(MjsimError):
    """A call came at the wrong moment, such as a step before the first reset."""


class ViewerError(MjsimError):
    """No window could be opened."""
