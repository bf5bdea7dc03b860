"""Typed errors of the HUD.

    HudError
    ├── ConditionError    no assistance condition of that name, or it is not usable
    ├── TaskViewError     a task view names an object or receptacle that it does not hold
    ├── FrameError        a frame, picture or camera has an unusable shape
    ├── MessageError      no message of that key
    └── SchemaError       a dictionary does not describe a HUD state

Every message names the offending value and what to do about it.
"""


class HudError(Exception):
    """Base of every error raised by :mod:`hud`."""


class ConditionError(HudError):
    """No assistance condition of that name, or it is not usable."""


class TaskViewError(HudError):
    """A task view names an object or receptacle that it does not hold."""


class FrameError(HudError):
    """A frame, picture or camera has an unusable shape."""


class MessageError(HudError):
    """No message of that key."""


class SchemaError(HudError):
    """A dictionary does not describe a HUD state."""
