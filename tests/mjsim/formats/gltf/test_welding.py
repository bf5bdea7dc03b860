"""Walls of boxes have no T-junctions, at which a rasteriser leaves gaps, and look as before."""

import mujoco
import numpy as np
import pytest

from mjsim.formats.gltf.surfaces import drawn_scene, surfaces
from mjsim.formats.gltf.welding import UNIT, welded
from mjsim.house.compiled.house import compiled_house

# Two stretches of wall, and the pieces above and below a window between them
WALL = """<mujoco><worldbody>
  <geom type="box" pos="-1 0 1.3" size="1 .03 1.3"/>
  <geom type="box" pos="1.5 0 1.3" size=".5 .03 1.3"/>
  <geom type="box" pos=".5 0 2.4" size=".5 .03 .2"/>
  <geom type="box" pos=".5 0 .45" size=".5 .03 .45"/>
  <geom type="box" pos=".5 0 1.5" size=".5 .01 .7" rgba="1 1 1 .3"/>
</worldbody></mujoco>"""


def outer_edges(surface):
    """Start and end (e, 2, 3) of the edges of one triangle alone, in UNIT; those between two have no gap."""
    edges = np.stack([surface.triangles, np.roll(surface.triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    _, first, uses = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    return np.rint(surface.positions / UNIT).astype(int)[edges[first[uses == 1]]]


def junctions(found):
    """Count the vertices of boxes that are inside an edge of a side of a box which is parallel to an axis."""
    points = np.unique(np.rint(np.concatenate([s.positions for s in found]) / UNIT).astype(int), axis=0)
    edges = np.concatenate([outer_edges(surface) for surface in found])
    count = 0
    for axis in range(3):
        rest = [(axis + 1) % 3, (axis + 2) % 3]
        on_line = {}
        for point in points:
            on_line.setdefault(tuple(point[rest]), []).append(point[axis])
        for start, end in edges[(edges[:, 0, rest] == edges[:, 1, rest]).all(axis=1)]:
            low, high = sorted((start[axis], end[axis]))
            count += sum(low < value < high for value in on_line[tuple(start[rest])])
    return count


@pytest.fixture(scope="module", params=["a wall", "apartment"])
def house(request):
    """A model, and what is drawn of it before and after it was welded."""
    if request.param == "apartment":
        compiled = compiled_house(request.getfixturevalue("catalogue"))
        model, data = compiled.model, compiled.data
    else:
        model = mujoco.MjModel.from_xml_string(WALL)
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
    before = list(surfaces(model, data, drawn_scene(model, data)))
    return model, before, welded(model, before)


@pytest.mark.slow
def test_no_corner_of_a_box_is_inside_an_edge(house):
    model, before, after = house
    is_box = model.geom_type == mujoco.mjtGeom.mjGEOM_BOX
    solid = [not s.is_translucent and is_box[s.geom] for s in before]
    assert junctions([s for s, box in zip(before, solid, strict=True) if box]) >= 8
    assert junctions([s for s, box in zip(after, solid, strict=True) if box]) == 0


def test_surfaces_keep_their_shape_and_texture(house):
    for before, after in zip(*house[1:], strict=True):
        one, other = (s.positions[s.triangles] for s in (before, after))
        crosses = [np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]) for c in (one, other)]
        areas = [np.linalg.norm(cross, axis=1) for cross in crosses]
        assert areas[1].sum() == pytest.approx(areas[0].sum()) and areas[1].min() > 0
        facing = np.einsum("ij,ij->i", crosses[1], after.normals[after.triangles[:, 0]])
        if before is not after and len(after.positions) > 24:
            assert (facing > 0).all(), "triangles face outwards"
            np.testing.assert_allclose(np.linalg.norm(after.normals, axis=1), 1.0, rtol=1e-6)
            assert (before.uv is None) == (after.uv is None)
            if after.uv is not None:
                low, high = before.uv.min(axis=0) - 1e-9, before.uv.max(axis=0) + 1e-9
                assert ((after.uv >= low) & (after.uv <= high)).all()
