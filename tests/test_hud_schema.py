"""The HUD state as JSON: nothing is lost, and the schema describes exactly what is written."""

import copy
import dataclasses
import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hud import sample
from hud.conditions import condition, condition_names
from hud.errors import SchemaError
from hud.messages import message
from hud.schema import from_dict, json_schema, to_dict
from hud.state import HudState


def conforms(schema: dict[str, Any], value: Any) -> bool:
    """A validator for the keywords in use, written from the JSON Schema specification."""
    if "anyOf" in schema:
        return any(conforms(s, value) for s in schema["anyOf"])
    if "enum" in schema:
        return value in schema["enum"]
    kind = schema["type"]
    if kind == "array":
        items = (
            schema.get("prefixItems") or [schema["items"]] * len(value) if isinstance(value, list) else None
        )
        return items is not None and len(items) == len(value) and all(map(conforms, items, value))
    if kind == "object":
        known = schema["properties"]
        return (
            isinstance(value, dict)
            and set(schema["required"]) <= set(value)
            and (schema["additionalProperties"] or set(value) <= set(known))
            and all(conforms(known[k], v) for k, v in value.items())
        )
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return {
        "null": value is None,
        "boolean": isinstance(value, bool),
        "integer": number and float(value).is_integer(),
        "number": number,
        "string": isinstance(value, str),
    }[kind]


@given(
    st.sampled_from([*condition_names(), "highlight-minimap", "optimal-minimap-xray", "optimal-regret"]),
    st.integers(0, 24),
    st.data(),
)
def test_states_survive_json_and_fit_the_schema(name: str, count: int, data: st.DataObject) -> None:
    steps = data.draw(st.integers(0, 2 * count))
    view = sample.task(count, steps=steps, message=message("picked", object="Novel", opacity=0.25))
    state = condition(name)(dataclasses.replace(view, bounds=(0.0, 0.0, 9.0, 7.5)))
    written = to_dict(state)
    read = json.loads(json.dumps(written))
    assert read == written, "only JSON values are written"
    assert from_dict(read) == state
    assert conforms(json_schema(), read)


def a_state() -> dict[str, Any]:
    view = sample.task(6, steps=1, message=message("picked"))
    state: HudState = condition("optimal")(view)
    return to_dict(state)


DAMAGE: dict[str, tuple[tuple[Any, ...], Any, str]] = {
    "a number for text": (("checklist", 0, "text"), 3, r"\$\.checklist\[0\]\.text"),
    "text for a number": (("markers", 0, "position", 1), "x", r"\$\.markers\[0\]\.position\[1\]"),
    "a vector of two": (("markers", 0, "size"), [1.0, 2.0], r"\$\.markers\[0\]\.size"),
    "an unknown shape": (("markers", 0, "shape"), "cone", "cone"),
    "an unknown tone": (("message", "kind"), "shout", "shout"),
    "no rows": (("checklist",), None, r"\$\.checklist"),
    "a truth for a count": (("total",), True, r"\$\.total"),
    "an extra field": (("extra",), 1, "extra"),
}


@pytest.mark.parametrize("what", sorted(DAMAGE))
def test_damage_is_refused_with_its_place_and_does_not_fit_the_schema(what: str) -> None:
    path, value, named = DAMAGE[what]
    raw = copy.deepcopy(a_state())
    node: Any = raw
    for key in path[:-1]:
        node = node[key]
    node[path[-1]] = value
    with pytest.raises(SchemaError, match=named):
        from_dict(raw)
    assert not conforms(json_schema(), raw)


def test_a_missing_field_is_refused() -> None:
    raw = a_state()
    del raw["bins"]
    with pytest.raises(SchemaError, match="bins"):
        from_dict(raw)
    assert not conforms(json_schema(), raw)


def test_the_schema_itself_is_json() -> None:
    assert json.loads(json.dumps(json_schema())) == json_schema()
