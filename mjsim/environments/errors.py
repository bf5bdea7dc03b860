"""Errors of the environments."""

from mjsim.values.errors import MjsimError


class EnvironmentConfigError(MjsimError):
    """An option of the environment is unknown or unusable."""


class EnvironmentStateError(MjsimError):
    """A call is not possible now, such as a step before the first reset."""


class ViewerError(MjsimError):
    """No window could be opened, or dm-control is not installed."""
