"""HudState as JSON, for a page that draws the HUD itself, and the JSON schema of that.

The schema is derived from the annotations of the value types, so it cannot drift from them.
"""

import dataclasses
import enum
import types
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from hud.errors import SchemaError
from hud.state import HudState

DIALECT = "https://json-schema.org/draft/2020-12/schema"

_SCALARS: tuple[tuple[type, str], ...] = (
    (bool, "boolean"),
    (int, "integer"),
    (float, "number"),
    (str, "string"),
)


def to_dict(state: HudState) -> dict[str, Any]:
    """Plain JSON values: dataclasses to objects, tuples to arrays, enumerations to their values."""
    plain: dict[str, Any] = _plain(state)
    return plain


def from_dict(raw: object) -> HudState:
    """The inverse of `to_dict`.

    Raises:
        SchemaError: A field is missing, unknown or of the wrong type; the message names where.
    """
    state: HudState = _parse(HudState, raw, "$")
    return state


def json_schema() -> dict[str, Any]:
    """JSON schema of what `to_dict` returns."""
    return {"$schema": DIALECT, "title": "HudState", **_describe(HudState)}


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: _plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, enum.Enum):
        return value.value
    if isinstance(value, tuple):
        return [_plain(v) for v in value]
    return value


def _is_union(kind: Any) -> bool:
    return get_origin(kind) in (Union, types.UnionType)


def _describe(kind: Any) -> dict[str, Any]:
    if _is_union(kind):
        return {"anyOf": [_describe(k) for k in get_args(kind)]}
    if kind is type(None):
        return {"type": "null"}
    if get_origin(kind) is Literal:
        return {"enum": list(get_args(kind))}
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        return {"enum": [member.value for member in kind]}
    if get_origin(kind) is tuple:
        items = get_args(kind)
        if items[-1] is Ellipsis:
            return {"type": "array", "items": _describe(items[0])}
        described = [_describe(k) for k in items]
        return {"type": "array", "prefixItems": described, "minItems": len(items), "maxItems": len(items)}
    if dataclasses.is_dataclass(kind):
        hints = get_type_hints(kind)
        return {
            "type": "object",
            "properties": {f.name: _describe(hints[f.name]) for f in dataclasses.fields(kind)},
            "required": [f.name for f in dataclasses.fields(kind)],
            "additionalProperties": False,
        }
    return {"type": next(name for scalar, name in _SCALARS if kind is scalar)}


def _parse(kind: Any, raw: Any, where: str) -> Any:
    if _is_union(kind):
        if raw is None and type(None) in get_args(kind):
            return None
        return _parse(next(k for k in get_args(kind) if k is not type(None)), raw, where)
    if get_origin(kind) is Literal or (isinstance(kind, type) and issubclass(kind, enum.Enum)):
        return _parse_choice(kind, raw, where)
    if get_origin(kind) is tuple:
        return _parse_array(get_args(kind), raw, where)
    if dataclasses.is_dataclass(kind):
        return _parse_object(kind, raw, where)
    accepted = (int, float) if kind is float else (kind,)
    if not isinstance(raw, accepted) or (isinstance(raw, bool) and kind is not bool):
        raise SchemaError(f"{where} must be a {kind.__name__}, got {raw!r}")
    return kind(raw)


def _parse_choice(kind: Any, raw: Any, where: str) -> Any:
    choices: dict[Any, Any] = {v: v for v in get_args(kind)}
    if isinstance(kind, enum.EnumMeta):
        members: list[Any] = list(kind)
        choices = {m.value: m for m in members}
    if raw not in choices:
        raise SchemaError(f"{where} must be one of {list(choices)}, got {raw!r}")
    return choices[raw]


def _parse_array(items: tuple[Any, ...], raw: Any, where: str) -> tuple[Any, ...]:
    if not isinstance(raw, list):
        raise SchemaError(f"{where} must be an array, got {raw!r}")
    kinds = (items[0],) * len(raw) if items[-1] is Ellipsis else items
    if len(kinds) != len(raw):
        raise SchemaError(f"{where} must have {len(kinds)} elements, got {len(raw)}")
    return tuple(_parse(k, v, f"{where}[{i}]") for i, (k, v) in enumerate(zip(kinds, raw, strict=True)))


def _parse_object(kind: Any, raw: Any, where: str) -> Any:
    names = [f.name for f in dataclasses.fields(kind)]
    if not isinstance(raw, dict) or set(raw) != set(names):
        found = sorted(map(str, raw)) if isinstance(raw, dict) else raw
        raise SchemaError(f"{where} must be an object with the fields {names}, got {found!r}")
    hints = get_type_hints(kind)
    return kind(**{name: _parse(hints[name], raw[name], f"{where}.{name}") for name in names})
