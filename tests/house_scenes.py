"""Small scenes of the kinds that other simulators have, written for tests: a flat of two rooms with a table."""

from pathlib import Path

import numpy as np
import trimesh
from PIL import Image
from trimesh.visual import TextureVisuals

WIDTH, DEPTH, HEIGHT, THICK = 8.0, 5.0, 2.6, 0.1
# Walls as boxes: middle and sides, m. The partition leaves a doorway of 1 m.
WALLS = {
    "south": ((4, -THICK / 2), (WIDTH + 2 * THICK, THICK)),
    "north": ((4, DEPTH + THICK / 2), (WIDTH + 2 * THICK, THICK)),
    "west": ((-THICK / 2, 2.5), (THICK, DEPTH)),
    "east": ((WIDTH + THICK / 2, 2.5), (THICK, DEPTH)),
    "partition_south": ((4, 1.0), (THICK, 2.0)),
    "partition_north": ((4, 4.0), (THICK, 2.0)),
}


def table() -> trimesh.Trimesh:
    """A table of one mesh, 1.2 x 0.7 x 0.75 m, on the origin."""
    parts = [trimesh.creation.box((1.2, 0.7, 0.05)).apply_translation((0, 0, 0.725))]
    for x in (-0.55, 0.55):
        for y in (-0.3, 0.3):
            parts.append(trimesh.creation.box((0.06, 0.06, 0.72)).apply_translation((x, y, 0.36)))
    return trimesh.boolean.union(parts, engine="manifold")


def boxes() -> dict[str, trimesh.Trimesh]:
    """Floor and walls."""
    made = {"floor": trimesh.creation.box((WIDTH, DEPTH, 0.1)).apply_translation((4, 2.5, -0.05))}
    for name, ((x, y), (a, b)) in WALLS.items():
        made[name] = trimesh.creation.box((a, b, HEIGHT)).apply_translation((x, y, HEIGHT / 2))
    return made


def write_sdf(folder: Path, *, extra: str = "", walls: bool = True) -> Path:
    """A Gazebo world: walls are boxes, the table is an OBJ mesh in millimetres, a door closes the doorway."""
    models = folder / "models" / "table"
    (models / "meshes").mkdir(parents=True)
    mesh = table().apply_scale(1000)
    mesh.visual = TextureVisuals(
        uv=mesh.vertices[:, :2] / 1000, image=Image.new("RGB", (64, 32), (150, 90, 40))
    )
    mesh.export(models / "meshes" / "table.obj")
    (models / "model.sdf").write_text(
        '<sdf version="1.6"><model name="table"><link name="link"><visual name="v"><geometry><mesh>'
        "<uri>model://table/meshes/table.obj</uri><scale>0.001 0.001 0.001</scale>"
        "</mesh></geometry></visual></link></model></sdf>"
    )
    parts = [_box_model("floor", (4, 2.5, -0.05), (WIDTH, DEPTH, 0.1))]
    if walls:
        parts += [
            _box_model(name, (x, y, HEIGHT / 2), (a, b, HEIGHT)) for name, ((x, y), (a, b)) in WALLS.items()
        ]
    parts.append(_box_model("door_1", (4, 2.5, 1.0), (0.05, 1.0, 2.0)))
    parts.append(_box_model("sofa", (1.0, 0.6, 0.3), (1.8, 0.8, 0.6)))
    parts.append(_box_model("cup", (6.0, 2.0, 0.8), (0.08, 0.08, 0.1), static=False))
    path = folder / "worlds" / "flat.world"
    path.parent.mkdir()
    path.write_text(
        '<?xml version="1.0"?><sdf version="1.6"><world name="flat"><include><uri>model://table</uri>'
        f"<pose>6 2 0 0 0 0.5</pose></include>{''.join(parts)}{extra}</world></sdf>"
    )
    return path


def _box_model(
    name: str, middle: tuple[float, float, float], sides: tuple[float, float, float], *, static: bool = True
) -> str:
    shape = f"<geometry><box><size>{_text(sides)}</size></box></geometry>"
    colour = "<material><diffuse>0.8 0.7 0.6 1</diffuse></material>"
    link = f'<collision name="c">{shape}</collision><visual name="v">{shape}{colour}</visual>'
    return (
        f'<model name="{name}"><static>{str(static).lower()}</static><pose>{_text(middle)} 0 0 0</pose>'
        f'<link name="l">{link}</link></model>'
    )


def _text(values: tuple[float, ...]) -> str:
    return " ".join(f"{value:g}" for value in np.asarray(values, float))
