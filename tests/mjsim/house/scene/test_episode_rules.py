"""Every convention of an episode: a change that breaks it is told by `mjsim check`, and refused where it is loaded."""

import json
import math
from dataclasses import replace

import pytest

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.check import check_path
from mjsim.house.scene.sampling import sample_episode
from mjsim.house.scene.scene import compose
from mjsim.house.validation.findings import errors
from mjsim.values.episode import StartPose
from mjsim.values.errors import EpisodeError


@pytest.fixture(scope="module")
def good(catalogue):
    return sample_episode(catalogue, objects=6, seed=2)


def first(**changes):
    """Change the first object."""
    return lambda e: replace(e, objects=(replace(e.objects[0], **changes), *e.objects[1:]))


def moved(x, y, z):
    return first(position=(x, y, z))


def renamed(name):
    def change(e):
        targets = {name if k == e.objects[0].name else k: v for k, v in e.targets.items()}
        return replace(e, objects=(replace(e.objects[0], name=name), *e.objects[1:]), targets=targets)

    return change


def onto_the_second(e):
    return replace(e, objects=(replace(e.objects[0], position=e.objects[1].position), *e.objects[1:]))


def other_target(e):
    name = e.objects[0].name
    return replace(e, targets={**e.targets, name: next(r for r in e.receptacles if r != e.targets[name])})


def crowd(e):
    objects = tuple(replace(e.objects[0], name=f"object_{i:03d}") for i in range(201))
    return replace(e, objects=objects, targets={o.name: e.targets[e.objects[0].name] for o in objects})


# The change, and the rule and a word by which the finding tells it.
BROKEN = {
    "start outside": (lambda e: replace(e, start=StartPose(-5.0, 2.0, 0.0)), "start", "outside"),
    "start in a wall": (lambda e: replace(e, start=StartPose(4.34, 2.0, 0.0)), "overlap", "start"),
    "start in the bed": (lambda e: replace(e, start=StartPose(1.0, 2.0, 0.0)), "overlap", "furniture"),
    "below the floor": (moved(3.0, 5.0, -1.0), "poses", "z = -1.00"),
    "in the air": (moved(3.0, 5.0, 30.0), "poses", "z = 30.00"),
    "half in the floor": (moved(3.0, 5.0, -0.02), "overlap", "floor"),
    "outside": (moved(30.0, 5.0, 0.0), "poses", "outside"),
    "in a wall": (moved(4.34, 2.0, 0.5), "overlap", "wall"),
    "in another": (onto_the_second, "overlap", "object_0"),
    "zero quaternion": (first(quaternion=(0.0, 0.0, 0.0, 0.0)), "poses", "norm 0"),
    "long quaternion": (first(quaternion=(2.0, 0.0, 0.0, 0.0)), "poses", "norm 2"),
    "wrong category": (first(category="nonsense"), "objects", "'nonsense'"),
    "unknown model": (first(model="elephant"), "objects", "'elephant'"),
    "wrong target": (other_target, "receptacles", "is to go into"),
    "unknown receptacle": (lambda e: replace(e, receptacles=(*e.receptacles, "well")), "receptacles", "well"),
    "a name with a slash": (renamed("a/b"), "names", "'a/b'"),
    "no name": (renamed(""), "names", "''"),
    "the person's name": (renamed("avatar"), "names", "'avatar'"),
    "a bin's name": (renamed("dish_bin"), "names", "'dish_bin'"),
    "201 objects": (crowd, "objects", "201"),
}


@pytest.mark.parametrize("change", BROKEN)
def test_a_broken_episode_is_told_and_refused(change, good, catalogue, tmp_path):
    make, rule, word = BROKEN[change]
    spoiled = make(good)
    spoiled.save(tmp_path / "episode.json")
    found = errors(check_path(str(tmp_path / "episode.json")).findings)
    assert any(f.rule == rule and word in str(f) for f in found), [str(f) for f in found]
    with pytest.raises(EpisodeError) as refused:
        compose(spoiled, catalogue)
    assert "\n" not in str(refused.value)


def test_a_sampled_episode_has_no_findings(good, tmp_path):
    good.save(tmp_path / "episode.json")
    assert check_path(str(tmp_path / "episode.json")).findings == ()


def test_what_nobody_reaches_is_told(good, tmp_path):
    """On the far side of the bed, from the middle of which the floor is out of reach."""
    moved(1.2, 2.0, 0.9)(good).save(tmp_path / "episode.json")
    assert any(f.rule == "reach" for f in check_path(str(tmp_path / "episode.json")).findings)


def test_too_many_for_a_bin_is_a_warning(good, tmp_path):
    sample_episode(Catalogue.load(), objects=40, seed=0).save(tmp_path / "ok.json")
    many = replace(
        good,
        objects=tuple(replace(good.objects[0], name=f"o{i}") for i in range(9)),
        targets={f"o{i}": good.targets[good.objects[0].name] for i in range(9)},
    )
    many.save(tmp_path / "episode.json")
    told = check_path(str(tmp_path / "episode.json")).findings
    assert [f.severity for f in told if "9 objects" in f.message] == ["warning"]
    assert check_path(str(tmp_path / "ok.json")).usable


@pytest.mark.parametrize("pose", [(math.nan, 0, 0), (0, math.inf, 0), (0, 0, math.nan)])
def test_a_start_is_finite(good, pose):
    with pytest.raises(EpisodeError, match="finite"):
        replace(good, start=StartPose(*pose))


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"\xff\xfe{",
        b"[" * 100_000,
        b'{"format": ' + b"[" * 100_000,
        b'{"format": 1}',
        json.dumps({"format": 1, "start": {"x": "NaN"}}).encode(),
    ],
)
def test_a_file_that_is_no_episode_is_one_finding(text, tmp_path):
    path = tmp_path / "episode.json"
    path.write_bytes(text)
    (finding,) = check_path(str(path)).findings
    assert finding.rule == "file" and "\n" not in str(finding)
