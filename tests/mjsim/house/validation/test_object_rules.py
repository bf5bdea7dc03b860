"""Every convention of an object: a file that breaks it, made from a good one by one change, is refused by its rule."""

import pytest

from mjsim.house.validation.findings import errors
from mjsim.house.validation.object_rules import check_object

GOOD = """
<mujoco model="block">
  <compiler angle="radian"/>
  <worldbody>
    <body name="object">
      <geom name="look" type="box" pos="0 0 0.05" size="0.06 0.04 0.05" group="2" contype="0" conaffinity="0" mass="0"/>
      <geom name="part" type="box" pos="0 0 0.05" size="0.06 0.04 0.05" group="3" mass="0.3"/>
      <site name="grip_0" pos="0 0 0.1"/>
      <site name="grip_1" pos="0 0 0.1" quat="0 0 0 1"/>
    </body>
  </worldbody>
</mujoco>
"""
BALL = '<geom name="part" type="sphere" pos="0 0 0.05" size="0.05" group="3" mass="0.3"/>'
PART = '<geom name="part" type="box" pos="0 0 0.05" size="0.06 0.04 0.05" group="3" mass="0.3"/>'
BODY = '<body name="object">'
INERTIAL = '<inertial pos="{pos}" mass="0.3" diaginertia="{inertia}"/>'

# What is replaced, by what, and the rule and the word by which the finding tells it.
BROKEN = {
    "not XML": ("</mujoco>", "", "file", "does not compile"),
    "negative size": ("0.06 0.04 0.05", "-0.06 0.04 0.05", "file", "does not compile"),
    "missing mesh": (PART,
        '<geom name="part" type="mesh" mesh="m"/></body></worldbody><asset><mesh name="m" file="no.obj"/></asset>'
        '<worldbody><body name="x">', "file", "no.obj"),
    "another body name": (BODY, '<body name="thing">', "body", "thing"),
    "a second body": (BODY, '<body name="lid"/>' + BODY, "body", "lid"),
    "a geom outside": (BODY, '<geom size="0.1"/>' + BODY, "body", "outside"),
    "a free joint": (BODY, BODY + '<freejoint name="free"/>', "joints", "'free'"),
    "a hinge": (BODY, BODY + '<joint name="hinge" type="hinge"/>', "joints", "'hinge'"),
    "no weight": (BODY, '<body name="object" gravcomp="1">', "contents", "gravcomp"),
    "an actuator": ("</mujoco>", '<keyframe><key name="k"/></keyframe></mujoco>', "contents", "keyframes"),
    "NaN position": (PART, PART.replace('pos="0 0 0.05"', 'pos="nan 0 0.05"'), "finite", "pos=nan"),
    "NaN mass": ('mass="0.3"', 'mass="nan"', "finite", "mass=nan"),
    "infinite": (PART, PART.replace('pos="0 0 0.05"', 'pos="0 inf 0.05"'), "finite", "pos=inf"),
    "1000 kg": ('mass="0.3"', 'mass="1000"', "mass", "1000 kg"),
    "a feather": ('mass="0.3"', 'mass="0.001"', "mass", "0.001 kg"),
    "centre of mass outside": (BODY, BODY + INERTIAL.format(pos="5 0 0", inertia="1e-3 1e-3 1e-3"), "inertia",
        "outside"),
    "hard to turn": (BODY, BODY + INERTIAL.format(pos="0 0 .05", inertia="9 9 9"), "inertia", "9.0"),
    "a needle's inertia": (BODY, BODY + INERTIAL.format(pos="0 0 .05", inertia="1e-9 1e-9 1e-9"), "inertia",
        "e-09"),
    "half a metre": ("0.06 0.04 0.05", "0.25 0.04 0.05", "size", "0.5 m"),
    "millimetres": ("0.06 0.04 0.05", "60 40 50", "size", "scale the meshes by 0.001"),
    "tiny": ("0.06 0.04 0.05", "0.02 0.02 0.02", "size", "0.04 m"),
    "below the floor": (PART, PART.replace("0 0 0.05", "0 0 0.02"), "rest", "-0.030"),
    "above the floor": (PART, PART.replace("0 0 0.05", "0 0 0.09"), "rest", "0.040"),
    "origin aside": (PART, PART.replace("0 0 0.05", "0.05 0 0.05"), "rest", "0.05 m"),
    "no grip": ('<site name="grip_1" pos="0 0 0.1" quat="0 0 0 1"/>', "", "grips", "grip_1"),
    "grip 5 m off": ('grip_0" pos="0 0 0.1"', 'grip_0" pos="5 0 0.1"', "grips", "grip_0 at [5.0"),
    "grip inside": ('grip_0" pos="0 0 0.1"', 'grip_0" pos="0 0 0.05"', "grips", "grip_0 at"),
    "grip above": ('grip_0" pos="0 0 0.1"', 'grip_0" pos="0 0 0.2"', "grips", "grip_0 at"),
    "grip on its side": ('grip_0" pos="0 0 0.1"', 'grip_0" pos="0 0 0.1" euler="1.57 0 0"', "grips",
        "does not point up"),
    "grips alike": (' quat="0 0 0 1"', "", "grips", "180 degrees"),
    "nothing collides": (PART, PART.replace('mass="0.3"', 'contype="0" conaffinity="0" mass="0.3"'),
        "contact", ""),
    "other contact bits": (PART, PART.replace('mass="0.3"', 'contype="2" mass="0.3"'), "contact",
        'contype="2"'),
    "collides but decoration": (PART, PART.replace('group="3"', 'group="2"'), "groups", "'part'"),
    "invisible": ('group="2" contype="0" conaffinity="0" mass="0"', 'group="3" mass="0"', "groups",
        "no geom is seen"),
    "looks that are structure": ('group="2" contype', 'group="0" contype', "groups", "'look'"),
}  # fmt: skip
SURPRISING = {
    "thin": (PART, PART + '<geom type="box" pos="0 0 0.05" size="0.05 0.03 0.001" group="3" mass="0.1"/>',
        "thin"),
    "rolls": (PART, BALL, "rolling"),
    "looks elsewhere": ('size="0.06 0.04 0.05" group="2"', 'size="0.16 0.04 0.05" group="2"', "looks"),
}  # fmt: skip


def findings(folder, old, new):
    assert old in GOOD
    path = folder / "block.xml"
    path.write_text(GOOD.replace(old, new), encoding="utf-8")
    return check_object(path)


def test_the_good_one_has_no_findings(tmp_path):
    assert findings(tmp_path, "block", "block") == []


@pytest.mark.parametrize("change", BROKEN)
def test_an_object_that_breaks_a_convention_is_refused_by_that_rule(change, tmp_path):
    old, new, rule, word = BROKEN[change]
    found = errors(findings(tmp_path, old, new))
    assert any(f.rule == rule and word in str(f) for f in found), [str(f) for f in found]
    assert all(
        f.remedy and "\n" not in str(f) and str(f).startswith("object block (block.xml): ") for f in found
    )


@pytest.mark.parametrize("change", SURPRISING)
def test_what_only_surprises_is_a_warning(change, tmp_path):
    old, new, rule = SURPRISING[change]
    found = findings(tmp_path, old, new)
    assert [f.rule for f in found] == [rule] and not errors(found)


def test_a_file_in_another_encoding_and_a_missing_one_are_told(tmp_path):
    path = tmp_path / "block.xml"
    assert check_object(path)[0].rule == "file"
    path.write_bytes(GOOD.replace("block", "bl\xf6ck").encode("latin-1"))
    assert "UTF-8" in check_object(path)[0].message
