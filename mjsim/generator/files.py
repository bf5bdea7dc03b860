"""Write the MJCF model, catalogue, recipe and textures of a generated house."""

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from pathlib import Path

from mjsim.generator.palette import surfaces
from mjsim.generator.placements import drop_points
from mjsim.generator.recipe import RECIPE, Recipe
from mjsim.generator.shell import shell
from mjsim.generator.values import Asset, Furnishing
from mjsim.generator.views import landscapes
from mjsim.support.toml import read_toml, toml_tables

# Model that provides default classes, materials, categories and objects for all generated houses.
STYLE = "houses/apartment"
# Materials that every house needs, because default classes and contact shadows use them.
_ALWAYS = {"white", "ceiling", "shadow_box", "shadow_round", "shadow_edge"}
_SHADOWS = 15.0  # range of shadows in metres; shorter ranges cause speckles on round objects
_HEAD = """\
<mujoco model="{name}">
<compiler angle="radian" texturedir="textures"/>
<statistic center="{x:g} {y:g} 0.8" extent="{extent:g}"/>
<visual>
<headlight ambient="0.53 0.53 0.53" diffuse="0.05 0.05 0.05" specular="0 0 0"/>
<map znear="0.006" zfar="6" shadowclip="{clip:g}"/>
<quality shadowsize="2048" numslices="16" numstacks="8" numquads="1"/>
</visual>
{default}
<asset>
{assets}
</asset>
<worldbody>
<light name="lamp" type="directional" pos="{x:g} {y:g} 2.55" dir="0 0 -1" diffuse="0.28 0.28 0.26" specular="0.1 0.1 0.1" castshadow="true"/>
<light name="day" type="directional" pos="{x:g} {y:g} 6" dir="0.2 -1 -0.35" diffuse="0.27 0.26 0.24" specular="0.1 0.1 0.1" castshadow="false"/>
<light name="fill" type="directional" pos="{x:g} {y:g} 6" dir="-0.9 0.2 -0.2" diffuse="0.23 0.23 0.24" specular="0 0 0" castshadow="false"/>
<light name="bounce" type="directional" pos="{x:g} {y:g} 0" dir="0.2 0.5 1" diffuse="0.38 0.37 0.34" specular="0 0 0" castshadow="false"/>
{world}
</worldbody>
</mujoco>
"""  # noqa: E501


def house_files(recipe: Recipe, furnishing: Furnishing, models: Path) -> Mapping[str, bytes]:
    """Return the contents of a house's files by path. Every process generates the same bytes.

    Args:
        recipe: Recipe of the house.
        furnishing: Furniture and bins of the house.
        models: Folder with the models in this package.
    """
    plan = recipe.plan
    world = "\n".join([*shell(plan), *_furniture(furnishing)])
    own = {asset.name: asset for placed in furnishing.placements for asset in placed.assets}
    own |= {asset.name: asset for asset in landscapes(recipe.seed)}
    (x, y), extent = plan.bounds.center, max(plan.bounds.width, plan.bounds.depth) * 0.62
    style = ET.parse(models / STYLE / "defaults.xml").getroot()
    house = _HEAD.format(
        name=f"generated_{recipe.seed}_{len(plan.rooms)}",
        x=round(x, 3),
        y=round(y, 3),
        extent=round(extent, 3),
        clip=round(_SHADOWS / extent, 3),
        default=ET.tostring(style[0], encoding="unicode").strip(),
        assets="\n".join(used_materials(world, surfaces(recipe.seed, plan), own.values(), models)),
        world=world,
    )
    files = {
        "house.xml": house.encode(),
        "catalogue.toml": _catalogue(recipe, furnishing, models).encode(),
        RECIPE: recipe.encoded(),
    }
    for asset in own.values():
        if asset.image is not None:
            files[f"textures/{asset.name}.png"] = asset.image
    return files


def _furniture(furnishing: Furnishing) -> Iterable[str]:
    for number, placed in enumerate(furnishing.placements):
        x, y, z = placed.position
        yaw = placed.quarter_turns * math.pi / 2 + placed.turn
        yield (
            f'<body name="{placed.room}/{placed.name}_{number}" pos="{x:.4f} {y:.4f} {z:.4f}" euler="0 0 {yaw:.6f}">'
            f"{placed.geoms}</body>"
        )
    for number, place in enumerate(furnishing.places):
        yield f'<site name="place:{number}" class="mount" pos="{" ".join(f"{v:.4f}" for v in place)}"/>'
    for mount in furnishing.mounts:
        x, y, z = mount.position
        yaw = (mount.quarter_turns + 2) % 4 * math.pi / 2
        yield (
            f'<site name="mount:{mount.receptacle}" class="mount" pos="{x:.4f} {y:.4f} {z:.4f}" '
            f'euler="0 0 {yaw:.6f}"/>'
        )


def used_materials(world: str, own: list[str], brought: Iterable[Asset], models: Path) -> list[str]:
    """Return the MJCF elements of all materials and textures that a world uses.

    Materials in `own` and `brought` take precedence over materials of the apartment with the same name.
    """
    elements = [ET.fromstring(text) for text in own]
    for asset in brought:
        element = ET.fromstring(asset.xml)
        if asset.image is not None:
            element.set("file", f"{asset.name}.png")
        elements.append(element)
    known = {(element.tag, element.get("name", "")): element for element in elements}
    for element in ET.parse(models / STYLE / "materials.xml").getroot().iter():
        if element.tag in ("texture", "material"):
            known.setdefault((element.tag, element.get("name", "")), element)
    used = _ALWAYS | set(re.findall(r'material="([^"]+)"', world))
    materials = [known["material", name] for name in sorted(used) if ("material", name) in known]
    textures = sorted({texture for m in materials if (texture := m.get("texture"))})
    images = [known["texture", name] for name in textures if ("texture", name) in known]
    return [ET.tostring(element, encoding="unicode").strip() for element in (*images, *materials)]


def _catalogue(recipe: Recipe, furnishing: Furnishing, models: Path) -> str:
    plan = recipe.plan
    points = drop_points(plan, furnishing.places)
    source = read_toml(models / STYLE / "catalogue.toml")
    mounts = {mount.receptacle: mount for mount in furnishing.mounts}
    categories = {k: c for k, c in source["categories"].items() if c["receptacle"] in mounts}
    objects = [key for category in categories.values() for key in category["objects"]]
    receptacles = {
        key: {**entry, "place": mounts[key].place, "room": mounts[key].room}
        for key, entry in source["receptacles"].items()
        if key in mounts
    }
    return toml_tables(
        {
            "house": {"label": f"House {recipe.seed}", "model": "house.xml", "points": points},
            "rooms": {room.key: room.label for room in plan.rooms},
            **{f"categories.{key}": entry for key, entry in categories.items()},
            **{f"receptacles.{key}": entry for key, entry in receptacles.items()},
            **{f"objects.{key}": source["objects"][key] for key in objects},
        }
    )
