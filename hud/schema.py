"""Convert HUD states to and from JSON, and describe them with a JSON schema."""

import dataclasses
import enum
import re
from typing import Any

import msgspec
import numpy as np

from hud.errors import SchemaError
from hud.state import HudState

DIALECT = "https://json-schema.org/draft/2020-12/schema"
LARGEST = 1e6  # largest allowed coordinate, size or time


def to_dict(state: HudState) -> dict[str, Any]:
    """Convert a HUD state to values that JSON can represent."""
    plain: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(dataclasses.asdict(state)))
    return plain


def from_dict(raw: object) -> HudState:
    """Convert the result of `to_dict` back to a HUD state.

    Raises:
        SchemaError: A field is missing, unknown or of the wrong type. The message contains the field's path.
    """
    try:
        state = msgspec.convert(raw, HudState)
    except msgspec.ValidationError as error:
        raise SchemaError(f"{error}; {_expected(str(error))}") from error
    _check_fields(raw, to_dict(state), "$")
    return state


def check_state(state: object) -> None:
    """Check that the result of a condition is a HUD state that can be drawn and converted to JSON.

    Raises SchemaError with the path of the invalid value.
    """
    if not isinstance(state, HudState):
        kind = "None" if state is None else f"a value of type {type(state).__name__}"
        raise SchemaError(f"{kind}; it must return a HudState")
    try:
        msgspec.convert(_plain(state, "$"), HudState)
    except msgspec.ValidationError as error:
        raise SchemaError(f"a HudState that cannot be shown: {error}") from error


def _plain(value: Any, where: str) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {
            f.name: _plain(getattr(value, f.name), f"{where}.{f.name}") for f in dataclasses.fields(value)
        }
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist(), where)
    if isinstance(value, tuple | list):
        return [_plain(item, f"{where}[{i}]") for i, item in enumerate(value)]
    if isinstance(value, float) and not abs(value) <= LARGEST:
        raise SchemaError(f"a HudState that cannot be shown: {value} is not a usable number - at `{where}`")
    if isinstance(value, str):
        try:
            value.encode()
        except UnicodeEncodeError as error:
            raise SchemaError(f"a HudState that cannot be shown: {error} - at `{where}`") from error
    return value.value if isinstance(value, enum.Enum) else value


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of the result of `to_dict`. All fields are required. No others are allowed."""
    schema = msgspec.json.schema(HudState)
    for definition in schema["$defs"].values():
        if "properties" in definition:
            definition |= {"required": list(definition["properties"]), "additionalProperties": False}
            for described in definition["properties"].values():
                described.pop("default", None)
    return {"$schema": DIALECT, "title": "HudState", **schema}


def _check_fields(raw: Any, written: Any, where: str) -> None:
    if isinstance(written, dict):
        if set(raw) != set(written):
            raise SchemaError(
                f"{where} must be an object with the fields {list(written)}, got {sorted(map(str, raw))}"
            )
        for name, value in written.items():
            _check_fields(raw[name], value, f"{where}.{name}")
    elif isinstance(written, list):
        for i, value in enumerate(written):
            _check_fields(raw[i], value, f"{where}[{i}]")


def _expected(error: str) -> str:
    """Return a hint on how to correct the value that caused an error message of msgspec."""
    definitions = json_schema()["$defs"]
    node = definitions["HudState"]
    for name in re.findall(r"\.(\w+)", error.rpartition(" at `")[2]):
        node = node["properties"][name]
        node = node.get("items") or node
        node = next((n for n in node.get("anyOf", ()) if n.get("type") != "null"), node)
        node = definitions[node["$ref"].rpartition("/")[2]] if "$ref" in node else node
    return (
        f"use one of {node['enum']}" if "enum" in node else "hud.schema.json_schema() describes every field"
    )
