"""Generate the client's protocol module from the server's message types: `make client-protocol`."""

import enum
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
from msgspec import inspect

from experiments.web import protocol
from experiments.web.state import TRANSITIONS, SessionPhase, Trigger

PATH = Path(__file__).parents[1] / "experiments" / "web" / "client" / "static" / "protocol.js"
CONSTANTS: tuple[str, ...] = ("MAX_INPUTS", "BEAT_PERIOD", "MAX_SILENCE", "MAX_STEPS_AHEAD")
CONSTANTS += ("DISPLAY_PERIOD", "KEY_FLAG", "REFUSED", "REPLACED", "IDLE", "TOO_MUCH")
ALIASES = {"Codec": protocol.Codec, "PauseReason": protocol.PauseReason, "Phase": SessionPhase}
UNIONS = {"FromBrowser": protocol.FromBrowser, "ToBrowser": protocol.ToBrowser}
_SCALARS: dict[type[inspect.Type], str] = {
    inspect.IntType: "number",
    inspect.FloatType: "number",
    inspect.StrType: "string",
    inspect.BoolType: "boolean",
    inspect.NoneType: "null",
    inspect.BytesType: "Uint8Array<ArrayBuffer>",
    inspect.AnyType: "unknown",
}
_HEAD = """\
// Types and constants of docs/protocol.md, made by `make client-protocol`; change them in experiments/web/protocol.py.
"""


def client_protocol() -> str:
    lines = [_HEAD]
    lines += [f"/** @typedef {{{_literals(alias)}}} {name} */" for name, alias in ALIASES.items()]
    found: dict[str, str] = {}
    for union in (*UNIONS.values(), protocol.FrameMessage):
        for info in inspect.multi_type_info(getattr(union, "__args__", (union,))):
            _collect(info, found)
    lines += found.values()
    for name, union in UNIONS.items():
        members = " | ".join(member.__name__ for member in union.__args__)
        lines.append(f"/** @typedef {{{members}}} {name} */")
    return "\n".join([*lines, "", *_constants()]) + "\n"


def _constants() -> Iterator[str]:
    yield f"export const FRAME_HEAD_BYTES = {protocol.FRAME_HEAD.size};"
    codecs = ", ".join(f'{number}: "{name}"' for name, number in protocol.CODECS.items())
    yield f"/** @type {{Record<number, Codec>}} */\nexport const CODECS = {{ {codecs} }};"
    yield from (f"export const {name} = {getattr(protocol, name)};" for name in CONSTANTS)
    startable = ", ".join(f'"{phase}"' for phase, trigger in TRANSITIONS if trigger is Trigger.RUN)
    yield "/** @type {readonly Phase[]} phases in which the clock can be started */"
    yield f"export const STARTABLE = [{startable}];"


def _literals(alias: Any) -> str:
    values = list(alias) if isinstance(alias, enum.EnumType) else alias.__args__
    return " | ".join(f'"{value}"' for value in values)


def _collect(info: inspect.Type, found: dict[str, str]) -> str:
    """Convert a type to TypeScript. Add the object types that it contains to `found` as typedefs."""
    match info:
        case inspect.StructType(cls=cls, fields=fields, tag=tag):
            return _object(cls, fields, [] if tag is None else [f'type: "{tag}"'], found)
        case inspect.DataclassType(cls=cls, fields=fields):
            return _object(cls, fields, [], found)
        case inspect.EnumType(cls=cls):
            names = {alias: name for name, alias in ALIASES.items()}
            return names.get(cls) or " | ".join(f'"{member.value}"' for member in cls)
        case inspect.LiteralType(values=values):
            return " | ".join(f'"{value}"' for value in values)
        case inspect.ListType(item_type=item) | inspect.VarTupleType(item_type=item):
            return f"Array<{_collect(item, found)}>"
        case inspect.TupleType(item_types=items):
            return f"[{', '.join(_collect(item, found) for item in items)}]"
        case inspect.DictType(key_type=key, value_type=value):
            return f"Record<{_collect(key, found)}, {_collect(value, found)}>"
        case inspect.UnionType(types=types):
            return " | ".join(_collect(kind, found) for kind in types)
        case inspect.Metadata(type=inner):
            return _collect(inner, found)
    return _SCALARS[type(info)]


def _object(cls: type, fields: tuple[inspect.Field, ...], extra: list[str], found: dict[str, str]) -> str:
    name = "HudMessage" if cls.__module__ == "hud.state" and cls.__name__ == "Message" else cls.__name__
    if name not in found:
        found[name] = ""  # prevents endless recursion if the type refers to itself
        sent = issubclass(cls, msgspec.Struct) and cls not in (
            *protocol.ToBrowser.__args__,
            protocol.FrameMessage,
        )
        optional = ["?" if sent and not field.required else "" for field in fields]
        parts = extra + [
            f"{field.encode_name}{mark}: {_collect(field.type, found)}"
            for field, mark in zip(fields, optional, strict=True)
        ]
        text = (cls.__doc__ or "").split("\n")[0]
        found.pop(name)
        found[name] = f"/** @typedef {{{{ {'; '.join(parts)} }}}} {name} {text} */"
    return name


if __name__ == "__main__":
    sys.stdout.write(client_protocol())
