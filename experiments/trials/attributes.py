"""Read the descriptions of fields from the docstring of their class."""

import dataclasses
import inspect
import re
import typing
from typing import Any

Columns = dict[str, tuple[str, str]]  # type and description of each column
_NAMES = {"NoneType": "null", "VisitKind": "str", "Status": "str", "Refusal": "str", "EventKind": "str"}


def described(kind: type[Any], leave_out: set[str] | frozenset[str] = frozenset()) -> Columns:
    """Return the type and the description of each field of a class, without inherited fields.

    The docstring of the class must describe all these fields.
    """
    texts, hints = attributes(kind), typing.get_type_hints(kind)
    names = (
        [field.name for field in dataclasses.fields(kind)]
        if dataclasses.is_dataclass(kind)
        else kind.__annotations__
    )
    return {name: (_type_name(hints[name]), texts[name]) for name in names if name not in leave_out}


def attributes(kind: type[Any]) -> dict[str, str]:
    """Return the description of each field in the docstring of a class. Python with -OO has no docstrings."""
    text = (inspect.getdoc(kind) or "").partition("Attributes:\n")[2]
    text = re.split(r"\n\n?(?=\S)", text)[0]
    entries = re.split(r"\n(?=    \w+(?:, \w+)*: )", "\n" + text)[1:]
    pairs = (entry.strip().split(": ", 1) for entry in entries)
    texts = {name: " ".join(what.split()) for name, what in pairs}
    return {name: what[0].upper() + what[1:] if what[1:2].isalpha() else what for name, what in texts.items()}


def _type_name(hint: Any) -> str:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is None:
        return _NAMES.get(hint.__name__, str(hint.__name__))
    if origin is typing.Literal:
        return "str"
    if origin in (list, dict, tuple):
        return f"{origin.__name__}[{', '.join(map(_type_name, arguments))}]"
    return " | ".join(_type_name(argument) for argument in arguments)
