"""Tests of the HUD state as JSON: nothing is lost, and the schema matches the written data."""

import copy
import dataclasses
import json

import hud_sample as sample
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from hud.conditions import CONDITIONS, condition
from hud.errors import SchemaError
from hud.messages import message
from hud.schema import from_dict, json_schema, to_dict

CONFORMS = Draft202012Validator(json.loads(json.dumps(json_schema()))).is_valid


@pytest.mark.slow
@given(
    st.sampled_from([*CONDITIONS, "highlight-minimap", "optimal-minimap-xray", "optimal-regret"]),
    st.integers(0, 24),
    st.data(),
)
def test_states_survive_json_and_fit_the_schema(name, count, data):
    steps = data.draw(st.integers(0, 2 * count))
    view = sample.task(
        count, steps=steps, message=message("picked", sample.TEXTS, object="Novel", opacity=0.25)
    )
    state = condition(name)(dataclasses.replace(view, bounds=(0.0, 0.0, 9.0, 7.5)))
    written = to_dict(state)
    read = json.loads(json.dumps(written))
    assert read == written, "only JSON values are written"
    assert from_dict(read) == state
    assert CONFORMS(read)


def a_state():
    view = sample.task(6, steps=1, message=message("picked", sample.TEXTS))
    state = condition("optimal")(view)
    return to_dict(state)


MISSING = object()  # stands for a missing field, which is rejected even if it has a default

DAMAGE = {
    "a number for text": (("checklist", 0, "text"), 3, r"\$\.checklist\[0\]\.text"),
    "text for a number": (("markers", 0, "position", 1), "x", r"\$\.markers\[0\]\.position\[1\]"),
    "a vector of two": (("markers", 0, "size"), [1.0, 2.0], r"\$\.markers\[0\]\.size"),
    "an unknown shape": (("markers", 0, "shape"), "cone",
        r"'cone' - at `\$\.markers\[0\]\.shape`.*'box', 'cyl"),
    "an unknown tone": (("message", "kind"), "shout", r"'shout' - at `\$\.message\.kind`.*'info', 'refusal'"),
    "no rows": (("checklist",), None, r"\$\.checklist"),
    "a truth for a count": (("total",), True, r"\$\.total"),
    "an extra field": (("extra",), 1, "extra"),
    "no bins": (("bins",), MISSING, "bins"),
    "no clock": (("clock",), MISSING, "clock"),
    "no x-ray": (("markers", 0, "x_ray"), MISSING, "x_ray"),
}  # fmt: skip


@pytest.mark.parametrize("what", sorted(DAMAGE))
def test_damage_is_refused_with_its_place_and_does_not_fit_the_schema(what):
    path, value, named = DAMAGE[what]
    raw = copy.deepcopy(a_state())
    node = raw
    for key in path[:-1]:
        node = node[key]
    node[path[-1]] = value
    if value is MISSING:
        del node[path[-1]]
    with pytest.raises(SchemaError, match=named):
        from_dict(raw)
    assert not CONFORMS(raw)


@pytest.mark.parametrize("raw", [None, 3, [], {1: 2}])
def test_what_is_no_object_is_refused(raw):
    with pytest.raises(SchemaError, match="json_schema"):
        from_dict(raw)
