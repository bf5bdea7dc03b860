"""The exceptions that the HUD raises."""


class HudError(Exception):
    """The base class of all exceptions in :mod:`hud`."""


class ConditionError(HudError):
    """Raised if an assistance condition does not exist or cannot be used."""


class TaskViewError(HudError):
    """Raised if a task view refers to an object or receptacle that it does not contain."""


class FrameError(HudError):
    """Raised if a frame, a picture or a camera has the wrong shape."""


class MessageError(HudError):
    """Raised if a message key does not exist."""


class SchemaError(HudError):
    """Raised if a value is not a valid HUD state."""
