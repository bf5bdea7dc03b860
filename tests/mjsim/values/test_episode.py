"""An episode is a value: JSON keeps every bit of it, and refuses what is not an episode."""

import json
import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjsim.values.episode import Episode, PlacedObject, StartPose
from mjsim.values.errors import EpisodeError

number = st.floats(allow_nan=False, allow_infinity=False)
text = st.text(st.characters(codec="utf-8"), max_size=12)


@st.composite
def episodes(draw):
    receptacles = draw(st.lists(text, min_size=1, max_size=4, unique=True))
    names = draw(st.lists(text, max_size=5, unique=True))
    placed = st.builds(
        PlacedObject,
        name=st.just(""),
        category=text,
        model=text,
        point=st.tuples(number, number),
        position=st.tuples(number, number, number),
        quaternion=st.tuples(number, number, number, number),
    )
    return Episode(
        house=draw(text),
        seed=draw(st.integers(0, 2**63 - 1)),
        start=draw(st.builds(StartPose, number, number, number)),
        objects=tuple(replace(draw(placed), name=name) for name in names),
        receptacles=tuple(receptacles),
        targets={name: draw(st.sampled_from(receptacles)) for name in names},
    )


@given(episodes())
def test_json_round_trip_keeps_every_bit(episode):
    text = episode.to_json()
    copy = Episode.from_json(text)
    assert copy == episode
    assert copy.to_json() == text  # also tells -0.0 from 0.0
    constants = []
    json.loads(text, parse_constant=constants.append)
    assert constants == []  # strict JSON has no NaN


@pytest.fixture
def small():
    placed = PlacedObject("a", "dishes", "mug", (1.0, 2.0), (1.0, 2.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    return Episode("apartment", 3, StartPose(0.0, 0.0, 0.0), (placed,), ("bin",), {"a": "bin"})


def test_file_round_trip(small, tmp_path):
    path = tmp_path / "deep" / "episode.json"
    small.save(path)
    assert Episode.load(path) == small
    path.write_text(small.to_json(), encoding="utf-8-sig")
    assert Episode.load(path) == small
    assert [p.name for p in path.parent.iterdir()] == ["episode.json"]


@pytest.mark.parametrize(
    ("change", "culprit"),
    [
        ({"targets": {}}, "a"),
        ({"targets": {"a": "bin", "b": "bin"}}, "b"),
        ({"targets": {"a": "shelf"}}, "shelf"),
    ],
)
def test_targets_must_fit(small, change, culprit):
    with pytest.raises(EpisodeError, match=culprit):
        replace(small, **change)


def test_names_are_unique(small):
    with pytest.raises(EpisodeError, match="unique"):
        replace(small, objects=small.objects * 2)


@pytest.mark.parametrize("seed", [-1, 2**63, 10**40])
def test_a_seed_fits_a_table(small, seed):
    with pytest.raises(EpisodeError, match=f"the seed is {seed}"):
        replace(small, seed=seed)


@pytest.mark.parametrize("field", ["point", "position", "quaternion"])
@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_poses_are_finite(small, field, bad):
    placed = small.objects[0]
    values = (bad, *getattr(placed, field)[1:])
    with pytest.raises(EpisodeError, match="finite"):
        replace(small, objects=(replace(placed, **{field: values}),))


@pytest.mark.parametrize("field", ["house", "seed", "start", "objects", "receptacles", "targets"])
def test_missing_field_is_named(small, field):
    raw = json.loads(small.to_json())
    del raw[field]
    with pytest.raises(EpisodeError, match=field):
        Episode.from_json(json.dumps(raw))


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": 99}', "not json", '{"format": 1, "house": 3}'])
def test_other_texts_are_refused(text):
    with pytest.raises(EpisodeError):
        Episode.from_json(text)


def test_true_is_no_number_of_a_format(small):
    with pytest.raises(EpisodeError, match="format True"):
        Episode.from_json(small.to_json().replace('"format": 1', '"format": true'))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"seed": 3', '"seed": 3, "seed": 77', "the key 'seed' is there twice"),
        ('"seed": 3', '"seed": 3, "sed": 77', "episode has the unknown field 'sed'"),
        ('"heading"', '"z": 0, "heading"', "start has the unknown field 'z'"),
        ('"model"', '"mass": 1, "model"', r"objects\[0\] has the unknown field 'mass'"),
        ('"seed": 3', '"seed": NaN', "not JSON"),
    ],
)
def test_what_nobody_reads_is_refused(small, old, new, said):
    with pytest.raises(EpisodeError, match=said):
        Episode.from_json(small.to_json().replace(old, new))


@pytest.mark.parametrize("field", ["point", "position", "quaternion"])
def test_short_poses_are_refused(small, field):
    raw = json.loads(small.to_json())
    raw["objects"][0][field].pop()
    with pytest.raises(EpisodeError, match=rf"objects\[0\]\.{field}"):
        Episode.from_json(json.dumps(raw))


def test_errors_name_the_file(tmp_path):
    missing, broken = tmp_path / "missing.json", tmp_path / "broken.json"
    broken.write_text("{", encoding="utf-8")
    for path in (missing, broken):
        with pytest.raises(EpisodeError, match=path.name):
            Episode.load(path)
