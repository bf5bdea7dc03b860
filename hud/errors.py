"""Exceptions raised by the HUD."""


class HudError(Exception):
    """Base class of all errors of :mod:`hud`."""


class ConditionError(HudError):
    """An assistance condition does not exist or cannot be used."""


class TaskViewError(HudError):
    """A task view refers to an object or receptacle that it does not contain."""


class FrameError(HudError):
    """A frame, picture or camera has the wrong shape."""


class MessageError(HudError):
    """A message key does not exist."""


class SchemaError(HudError):
    """A dictionary does not describe a HUD state."""
