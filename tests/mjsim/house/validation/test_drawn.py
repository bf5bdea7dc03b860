"""Overlaps and flickering faces of what is drawn, in models of a few geoms."""

from pathlib import Path

import mujoco
import pytest

from mjsim.house.validation.checked_model import Compiled
from mjsim.house.validation.drawn import coplanar_faces, describe, overlaps

MATERIALS = '<material name="red" rgba="1 0 0 1"/><material name="blue" rgba="0 0 1 1"/>'


def compiled(*bodies: str) -> Compiled:
    inside = "".join(f'<body name="{i}">{geoms}</body>' for i, geoms in enumerate(bodies))
    xml = f"<mujoco><asset>{MATERIALS}</asset><worldbody>{inside}</worldbody></mujoco>"
    return Compiled.of("house", Path("house.xml"), mujoco.MjModel.from_xml_string(xml))


def box(x: float = 0.0, z: float = 0.0, material: str = "red", more: str = "", half: float = 0.1) -> str:
    return f'<geom type="box" pos="{x} 0 {z}" size="{half} 0.1 0.1" material="{material}" {more}/>'


SEEN = 'contype="0" conaffinity="0" group="2"'


@pytest.mark.parametrize(
    ("other", "depth"),
    [
        (box(0.19), 0.01),
        (box(0.19, more=SEEN), 0.01),
        (box(0.197), 0.0),
        (box(0.21), 0.0),
        (box(0.1, more='group="3"'), 0.0),
        ('<geom type="ellipsoid" pos="0.18 0 0" size="0.1 0.1 0.1"/>', 0.02),
        (
            '<geom type="ellipsoid" pos="0.19 0.19 0" size="0.1 0.1 0.1"/>',
            0.0,
        ),  # only the bounding boxes overlap
    ],
)
def test_drawn_bodies_overlap_by_their_depth(other: str, depth: float) -> None:
    found = overlaps(compiled(box(), other))
    assert [fault.amount for fault in found] == pytest.approx([depth] if depth else [], abs=1e-4)


def test_geoms_of_one_body_may_overlap() -> None:
    assert not overlaps(compiled(box() + box(0.1)))


@pytest.mark.parametrize(
    ("geoms", "area"),
    [
        (box() + box(0.1, material="blue"), 0.1 * 0.2),
        (box() + box(0.1, material="red"), 0.0),
        (box() + box(0.1, 0.01, material="blue"), 0.1 * 0.19),  # their front faces
        (box() + box(0.2, material="blue"), 0.0),
    ],
)
def test_faces_in_one_plane_flicker_by_their_common_area(geoms: str, area: float) -> None:
    found = coplanar_faces(compiled(geoms))
    assert max((fault.amount for fault in found), default=0.0) == pytest.approx(area)


def test_geoms_without_materials_flicker_by_colour() -> None:
    plain = '<geom type="box" size="0.1 0.1 0.1" rgba="{} 0 0 1" pos="{} 0 0"/>'
    model = mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody><body>{plain.format(1, 0)}{plain.format(0.5, 0.1)}</body>"
        f'<body pos="0 3 0">{plain.format(1, 0)}{plain.format(1, 0.1)}</body></worldbody></mujoco>'
    )
    found = coplanar_faces(Compiled.of("house", Path("house.xml"), model))
    assert found and {(f.first, f.second) for f in found} == {(0, 1)}


def test_hidden_faces_do_not_flicker() -> None:
    hull = '<geom type="box" size="0.5 0.5 0.5"/>'
    assert not coplanar_faces(compiled(box() + box(0.1, material="blue") + hull))
    near = '<geom type="box" pos="0 {} 0" size="0.5 0.05 0.5" material="red"/>'
    walls = (
        near.format(0.16)
        + near.format(-0.16)
        + near.replace("0 {} 0", "0 0 0.16").replace("0.05 0.5", "0.5 0.05")
    )
    assert not coplanar_faces(compiled(box() + box(0.1, material="blue") + walls))


def test_a_report_names_the_worst_pair() -> None:
    model = compiled(box(), box(0.19), box(-0.18))
    assert describe(model, overlaps(model), 1000, "mm deep") == "2, at most 20 mm deep: 0 and 2"
    assert describe(model, [], 1000, "mm deep") == "none"
