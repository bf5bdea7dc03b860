"""Errors of the HUD.

HudError
├── ConditionError    an assistance condition does not exist or cannot be used
├── TaskViewError     a task view names an object or receptacle that it does not contain
├── FrameError        a frame, picture or camera has the wrong shape
├── MessageError      a message key does not exist
└── SchemaError       a dictionary does not describe a HUD state
"""


class HudError(Exception):
    """Base class of all errors of :mod:`hud`."""


class ConditionError(HudError):
    """An assistance condition does not exist or cannot be used."""


class TaskViewError(HudError):
    """A task view names an object or receptacle that it does not contain."""


class FrameError(HudError):
    """A frame, picture or camera has the wrong shape."""


class MessageError(HudError):
    """A message key does not exist."""


class SchemaError(HudError):
    """A dictionary does not describe a HUD state."""
