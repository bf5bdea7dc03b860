"""Write an imported object as MJCF, OBJ and PNG files. Equal objects always give identical files."""

import math
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import trimesh
from numpy.typing import NDArray

from mjsim.formats.scene.surface import Floats
from mjsim.importing.object.object_import import ImportedObject
from mjsim.importing.object.visual_mesh import VisualMesh
from mjsim.values.errors import AssetError

MODEL = "object.xml"
_ROLLING = "1 0.02 0.02"  # sliding, torsional and rolling friction of round objects

_MJCF = """\
<mujoco model="{key}">
  <!-- {label}. Imported from {source}; conventions in docs/models.md. -->
  <compiler angle="radian"/>
  <default>
    <default class="look">
      <geom group="2" contype="0" conaffinity="0" mass="0"/>
    </default>
    <default class="part">
      <geom group="3" condim="6" friction="{friction}" solref="0.008 1"/>
    </default>
  </default>
  <asset>
{assets}
  </asset>
  <worldbody>
    <body name="object">
      <inertial pos="{centre}" mass="{mass}" fullinertia="{inertia}"/>
      <geom class="look" type="mesh" mesh="{key}_look" material="{key}_look"/>
{geoms}
      <site name="grip_0" pos="{grip}" euler="0 0 {yaw:.6f}"/>
      <site name="grip_1" pos="{grip}" euler="0 0 {opposite:.6f}"/>
    </body>
  </worldbody>
</mujoco>
"""


def write_model(item: ImportedObject, folder: Path, *, key: str, label: str, source: str) -> Path:
    """Write the files of an object into an existing folder. Return the path of the MJCF file."""
    (folder / "look.obj").write_text("\n".join(obj_lines(item.visual)) + "\n", encoding="utf-8")
    if item.visual.picture is not None:
        write_png(folder / "look.png", item.visual.picture)
    for number, points in enumerate(item.hulls):
        text = trimesh.convex.convex_hull(points).export(file_type="obj", digits=6, header=None)
        (folder / f"part_{number}.obj").write_text(text, encoding="utf-8")
    path = folder / MODEL
    path.write_text(_mjcf(item, key, label, source), encoding="utf-8")
    return path


def _mjcf(item: ImportedObject, key: str, label: str, source: str) -> str:
    weight, inertia = item.weight, item.weight.inertia
    corner = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return _MJCF.format(
        key=key,
        label=comment(label),
        source=comment(source),
        friction=_ROLLING if item.rolls else "1 0.02 0.002",
        assets="\n".join(f"    {line}" for line in _assets(item, key)),
        centre=numbers(weight.centre),
        mass=f"{weight.mass:.6g}",
        inertia=" ".join(f"{value:.6g}" for value in corner),
        geoms="\n".join(f"      {line}" for line in _geoms(item, key)),
        grip=numbers(item.grip.point),
        yaw=item.grip.yaw,
        opposite=item.grip.yaw + math.pi,
    )


def _assets(item: ImportedObject, key: str) -> Iterator[str]:
    yield f'<mesh name="{key}_look" file="look.obj" inertia="shell"/>'
    for number in range(len(item.hulls)):
        yield f'<mesh name="{key}_part_{number}" file="part_{number}.obj"/>'
    shine = 'specular="0.2" shininess="0.3"'
    if item.visual.picture is None:
        red, green, blue = item.visual.colour
        yield f'<material name="{key}_look" rgba="{red:g} {green:g} {blue:g} 1" {shine}/>'
    else:
        yield f'<texture name="{key}_look" type="2d" file="look.png"/>'
        yield f'<material name="{key}_look" texture="{key}_look" {shine}/>'


def _geoms(item: ImportedObject, key: str) -> Iterator[str]:
    """Yield the geoms of the collision parts, with masses for programs that ignore `<inertial>`."""
    volumes = [trimesh.convex.convex_hull(points).volume for points in item.hulls]
    for number, volume in enumerate(volumes):
        mass = item.weight.mass * volume / sum(volumes)
        yield f'<geom class="part" type="mesh" mesh="{key}_part_{number}" mass="{mass:.6g}"/>'


def obj_lines(mesh: VisualMesh) -> Iterator[str]:
    """Yield the lines of an OBJ file with the geometry of a visual mesh."""
    yield from (f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in np.round(mesh.vertices, 6) + 0.0)
    columns = [mesh.faces + 1]
    if mesh.uv is not None:
        places, corner = np.unique(np.round(mesh.uv.reshape(-1, 2), 5), axis=0, return_inverse=True)
        yield from (f"vt {u:.5f} {v:.5f}" for u, v in places)
        columns.append(corner.reshape(-1, 3) + 1)
    normals, corner = np.unique(np.round(mesh.normals.reshape(-1, 3), 3) + 0.0, axis=0, return_inverse=True)
    yield from (f"vn {x:.3f} {y:.3f} {z:.3f}" for x, y, z in normals)
    columns.append(corner.reshape(-1, 3) + 1)
    join = "//" if mesh.uv is None else "/"
    for face in np.stack(columns, axis=-1).tolist():
        yield "f " + " ".join(join.join(map(str, corner)) for corner in face)


def write_png(path: Path, rgb: NDArray[np.uint8]) -> None:
    """Write an RGB image of shape (height, width, 3) to a PNG file."""
    done, data = cv2.imencode(".png", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_PNG_COMPRESSION, 4])
    if not done:
        raise AssetError(f"the picture {path} cannot be encoded as PNG")
    path.write_bytes(data.tobytes())


def numbers(values: Floats, digits: int = 7) -> str:
    """Format numbers for MJCF, rounded to a number of decimals."""
    return " ".join(f"{value:.6g}" for value in np.round(values, digits) + 0.0)


def comment(text: str) -> str:
    """Escape text for use in an XML comment."""
    return text.replace("--", "- -").replace("&", "and").replace("<", "(").replace(">", ")")
