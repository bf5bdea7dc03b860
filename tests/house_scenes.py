"""Small scenes of the kinds that other simulators have, written for tests: a flat of two rooms with a table."""

import json
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

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
        '<sdf version="1.6"><model name="table"><frame name="top"><pose>0 0 0.7 0 0 0</pose></frame>'
        '<link name="link"><pose relative_to="top">0 0 -0.7 0 0 0</pose><visual name="v"><geometry><mesh>'
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


def scene(scale: float = 1.0) -> trimesh.Scene:
    """The flat as nodes of a scene with y up, at a scale."""
    whole = trimesh.Scene()
    for name, mesh in {**boxes(), "table": table().apply_translation((6, 2, 0))}.items():
        mesh.visual = TextureVisuals(material=PBRMaterial(baseColorFactor=(0.5, 0.6, 0.7, 1)))
        whole.add_geometry(mesh, node_name=name, geom_name=name)
    whole.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0]))
    whole.apply_scale(scale)
    return whole


def write_glb(path: Path) -> Path:
    """The flat as glTF."""
    scene().export(path)
    return path


def write_obj(path: Path) -> Path:
    """The flat as one mesh in centimetres."""
    scene(100.0).to_geometry().export(path)
    return path


def write_habitat(folder: Path) -> Path:
    """The flat as Habitat's stage, a chest, and a ball that moves."""
    for kind in ("stages", "objects", "scenes"):
        (folder / kind).mkdir(parents=True)
    scene().export(folder / "stages" / "flat.glb")
    (folder / "stages" / "flat.stage_config.json").write_text('{"render_asset": "flat.glb", "up": [0, 1, 0]}')
    trimesh.creation.box((0.8, 0.9, 0.5)).export(folder / "objects" / "chest.glb")
    trimesh.creation.icosphere(2, 0.1).export(folder / "objects" / "ball.glb")
    for name in ("chest", "ball"):
        (folder / "objects" / f"{name}.object_config.json").write_text(
            json.dumps({"render_asset": f"{name}.glb"})
        )
    half = np.sqrt(0.5)
    items = [
        {"template_name": "objects/chest", "translation": [2, 0.45, -1], "rotation": [half, 0, half, 0],
         "motion_type": "static"},
        {"template_name": "ball", "translation": [3, 0.1, -3], "motion_type": "dynamic"},
    ]  # fmt: skip
    path = folder / "scenes" / "flat.scene_instance.json"
    path.write_text(
        json.dumps({"stage_instance": {"template_name": "stages/flat"}, "object_instances": items})
    )
    return path


def write_mjcf(folder: Path) -> Path:
    """The flat as MJCF: walls that are only seen, a cupboard with a hinged door, a motor, a cup that falls."""
    walls = "".join(
        f'<geom name="{name}" type="box" pos="{x} {y} 1.3" size="{a / 2} {b / 2} 1.3" material="plaster" contype="0" '
        'conaffinity="0" group="1"/>'
        for name, ((x, y), (a, b)) in WALLS.items()
    )
    Image.new("RGB", (16, 16), (200, 100, 50)).save(folder / "plaster.png")
    path = folder / "flat.xml"
    path.write_text(f"""<mujoco model="flat">
  <asset>
    <texture name="plaster" type="2d" file="plaster.png"/>
    <material name="plaster" texture="plaster" texrepeat="2 2" texuniform="true"/>
  </asset>
  <worldbody>
    <geom name="floor" type="plane" size="4 3 1" pos="4 2.5 0"/>
    {walls}
    <body name="bed" pos="1.2 4.2 0.25">
      <geom type="box" size="1 0.5 0.25" rgba="1 1 1 1" contype="0" conaffinity="0" group="1"/>
      <geom type="box" size="1 0.5 0.25" group="0"/>
    </body>
    <body name="cupboard" pos="7.5 4.6 0.5">
      <geom type="box" size="0.4 0.25 0.5"/>
      <body name="leaf" pos="0 -0.3 0"><joint name="hinge" axis="0 0 1"/><geom type="box" size="0.4 0.02 0.5"/></body>
    </body>
    <body name="cup" pos="6 1 0.1"><freejoint/><geom type="box" size="0.04 0.04 0.05"/></body>
  </worldbody>
  <actuator><motor joint="hinge"/></actuator>
</mujoco>""")
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


def write_procthor(path: Path, **changes: object) -> Path:
    """A house as ProcTHOR writes it: a kitchen open to an L-shaped living room, a bedroom and a bathroom."""
    plans = {
        "Kitchen": [(0, 0), (0, 4), (4, 4), (4, 0)],
        "LivingRoom": [(4, 0), (4, 4), (0, 4), (0, 6), (5, 6), (9, 6), (9, 0)],
        "Bedroom": [(0, 6), (0, 10), (5, 10), (5, 6)],
        "Bathroom": [(5, 6), (5, 10), (9, 10), (9, 6)],
    }
    rooms, walls = [], []
    for number, (kind, outline) in enumerate(plans.items(), 1):
        floor = [{"x": x, "y": 0, "z": z} for x, z in outline]
        rooms.append({"id": f"room|{number}", "roomType": kind, "floorPolygon": floor, "children": []})
        for start, end in zip(outline, outline[1:] + outline[:1], strict=True):
            low = [{"x": x, "y": 0, "z": z} for x, z in (start, end)]
            name = f"wall|{number}|{start[0]}|{start[1]}|{end[0]}|{end[1]}"
            walls.append(
                {
                    "id": name,
                    "roomId": f"room|{number}",
                    "polygon": [*low, *({**p, "y": 2.7} for p in low[::-1])],
                }
            )
    for wall in walls:  # nothing between kitchen and living room on the east, a doorway on the north
        if wall["id"] in ("wall|1|4|4|4|0", "wall|2|4|0|4|4"):
            wall["empty"] = True

    def opening(name, wall, rooms, low, high, **more):
        corners = [
            {"x": low, "y": more.pop("sill", 0), "z": 0},
            {"x": high, "y": more.pop("top", 2.1), "z": 0},
        ]
        return {
            "id": name,
            "wall0": wall,
            "room0": rooms[0],
            "room1": rooms[1],
            "holePolygon": corners,
            **more,
        }

    def thing(name, x, z, height, turn=0, children=(), **more):
        place, turned = {"x": x, "y": height / 2, "z": z}, {"x": 0, "y": turn, "z": 0}
        return {"id": name, "assetId": name.split("|")[0] + "_1", "position": place, "rotation": turned,
                "kinematic": True, "children": list(children), **more}  # fmt: skip

    house = {
        "rooms": rooms,
        "walls": walls,
        "doors": [
            opening("door|2|3", "wall|3|5|6|0|6", ("room|3", "room|2"), 3.2, 4.2, openable=True, openness=1),
            opening("door|2|4", "wall|4|9|6|5|6", ("room|4", "room|2"), 0.5, 1.5, openable=True, openness=0),
            opening("door|2|1", "wall|2|9|6|9|0", ("room|2", "room|2"), 2.0, 3.0, openable=False, openness=0),
        ],
        "windows": [opening("window|1|0", "wall|1|0|0|0|4", ("room|1", "room|1"), 1.0, 2.5, sill=0.9)],
        "objects": [
            thing("Bed|3|0", 1.0, 8.9, 0.9, 180),
            thing("Dresser|3|1", 4.4, 8.5, 1.0, 270, [
                thing("Vase|3|2", 4.4, 8.5, 2.2, kinematic=False)]),
            thing("Toilet|4|0", 8.4, 9.0, 0.9, 270),
            thing("Fridge|1|0", 0.5, 0.5, 1.8, 0),
            thing("Sofa|2|0", 6.5, 0.55, 0.9, 0),
            thing("GarbageCan|1|1", 0.4, 3.5, 0.55, 90),
            thing("Chair|2|3", 6.0, 3.0, 0.9, 30, kinematic=False),
        ],
        "proceduralParameters": {"ceilingMaterial": {"name": "ps_mat"}, "lights": []},
        "metadata": {"schema": "1.0.0"},
    }  # fmt: skip
    path.write_text(json.dumps({**house, **changes}))
    return path


KITCHEN = """\
room:
  walls:
    - {name: back, type: wall, size: [2, 1.5, 0.02], pos: [2, 0, 1.5]}
    - {name: back_backing, type: wall, backing: true, size: [2, 1.5, 0.1], pos: [2, 0, 1.5]}
    - {name: front, type: wall, wall_side: front, size: [2, 1.5, 0.02], pos: [2, -4, 1.5]}
    - {name: left, type: wall, wall_side: left, size: [2, 1.5, 0.02], pos: [0, -2, 1.5]}
    - {name: right, type: wall, wall_side: right, size: [2, 1.5, 0.02], pos: [4, -2, 1.5]}
    - {name: clock, type: wall_accessory, attach_to: back, pos: [1, null, 2]}
  floor:
    - {name: floor, type: floor, size: [2, 2, 0.02], pos: [2, -2, 0]}
main:
  group_origin: [0, 0]
  group_pos: [4, 0]
  group_z_rot: -1.5707963
  bottom:
    - {name: sink, type: sink}
    - {name: counter, type: counter, interior_obj: sink, size: [1.2, 0.65, 0.92], pos: [1, -0.325, 0.46]}
    - {name: stove, type: stove, size: [null, 0.66, 0.92], align_to: counter, side: right, alignment: top_back}
    - {name: oven, type: oven, size: [0.7, 0.6, 0.7]}
    - {name: tall, type: housing_cabinet, interior_obj: oven, padding: [[0, 0.1], null, [0.5, 0.8]],
       align_to: stove, side: right, alignment: bottom_back}
    - {name: upper, type: hinge_cabinet, size: [counter, 0.4, null], stack_height: 1.3, stack_fixtures: [counter],
       align_to: counter, side: top, alignment: back, offset: [0, 0, 0.6]}
    - {name: kettle, type: electric_kettle, placement: {fixture: counter}}
    - {name: rack, type: open_cabinet, enable: false}
"""


def write_robocasa(folder):
    """A kitchen with a row of fixtures along its right wall, as RoboCasa lays them out."""
    path = folder / "layout.yaml"
    path.write_text(KITCHEN)
    return path
