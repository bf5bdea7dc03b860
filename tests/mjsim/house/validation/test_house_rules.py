"""Every convention of a house and its receptacles: what breaks it, made from a good one by one change, is told."""

import pytest
from small_worlds import edited

from mjsim.house.check import check_path
from mjsim.house.compiled.house import CompiledHouse, compiled_house
from mjsim.house.scene.sampling import sample_episode
from mjsim.house.validation.findings import errors
from mjsim.house.validation.validate import check_house, require_usable
from mjsim.values.errors import AssetError

DOOR = '<body name="door" pos="3 2 1"><joint name="hinge" axis="0 0 1"/><geom type="box" size=".02 .4 1"/></body>'
END = "</worldbody>"
EAST = '<geom name="east" class="wall" pos="6.1 2 1.25" size="0.1 2 1.25"/>'
SOUTH = '<geom name="partition_south" class="wall" pos="3 0.75 1.25" size="0.05 0.75 1.25"/>'
LINTEL = '<geom name="lintel" class="wall" pos="3 2 2.25" size="0.05 0.5 0.25"/>'
FLOOR = '<geom name="floor" type="plane" size="5 5 0.1" pos="3 2 0"/>'
TRAY = 'mount:tray" pos="5.7 3.6 0"'
BOTTOM = '<geom pos="0 0 0.02" size="0.25 0.25 0.02"/>'

# File, what is replaced, by what; then the rule and a word by which the finding tells it.
BROKEN = {
    "hinged door": ("house.xml", END, DOOR + END, "joints", "'hinge' of body 'door'"),
    "moving furniture": ("house.xml", END,
        '<body name="cart" pos="1 1 1"><freejoint/><geom size=".1"/></body>' + END, "joints", "'cart'"),
    "a mocap body": ("house.xml", END, '<body name="ghost" mocap="true"/>' + END, "contents", "mocap"),
    "NaN wall": ("house.xml", 'pos="6.1 2 1.25"', 'pos="nan 2 1.25"', "finite", "pos=nan"),
    "infinite wall": ("house.xml", 'pos="6.1 2 1.25"', 'pos="inf 2 1.25"', "finite", "pos=inf"),
    "negative size": ("house.xml", 'size="0.1 2 1.25"', 'size="0.1 -2 1.25"', "file", "does not compile"),
    "missing mesh": ("house.xml", "<worldbody>", '<asset><mesh name="m" file="no.obj"/></asset><worldbody>',
        "file", "no.obj"),
    "missing texture": ("house.xml", "<worldbody>",
        '<asset><texture name="t" type="2d" file="no.png"/></asset><worldbody>', "file", "no.png"),
    "two of a name": ("house.xml", END, '<geom name="east" size="1"/>' + END, "file", "east"),
    "a name of a scene": ("house.xml", END, '<site name="tray/volume"/>' + END, "names", "tray/volume"),
    "a name of the person": ("house.xml", END, '<body name="avatar/base"/>' + END, "names", "avatar/base"),
    "no gravity": ("house.xml", "<worldbody>", '<option gravity="0 0 0"/><worldbody>', "options", "gravity"),
    "no contacts": ("house.xml", "<worldbody>", '<option><flag contact="disable"/></option><worldbody>',
        "options", "CONTACT"),
    "no room site": ("house.xml", 'name="room:west" ', 'name="west" ', "rooms", "west"),
    "a room too many": ("house.xml", '"room:west"', '"room:attic"', "rooms", "attic"),
    "a round room": ("house.xml", '"room:west" type="box"', '"room:west" type="sphere"', "rooms",
        "room:west"),
    "12 km": ("house.xml", 'size="1.5 2 1"', 'size="6000 2 1"', "size", "span"),
    "no mount": ("house.xml", '"mount:tray"', '"mount:trays"', "mounts", "mount:tray"),
    "a tilted mount": ("house.xml", TRAY + ' quat="0.70710678 0 0 -0.70710678"', TRAY + ' euler="0.3 0 0"',
        "mounts", "tilted"),
    "no outer wall": ("house.xml", EAST, "", "shell", "open over"),
    "a gap in the wall": ("house.xml", EAST, EAST.replace('2 1.25" size="0.1 2', '2.2 1.25" size="0.1 1.8'),
        "shell", "open over"),
    "walls of glass": ("house.xml", EAST, EAST.replace("/>", ' group="2" contype="0" conaffinity="0"/>'),
        "shell", "open"),
    "walls that nobody meets": ("house.xml", EAST, EAST.replace("/>", ' contype="2"/>'), "contact", "'east'"),
    "a walled-up door": ("house.xml", LINTEL, LINTEL.replace("2.25", "1.25").replace("0.25", "1.25"), "rooms",
        "no way leads into"),
    "a door of 0.45 m": ("house.xml", SOUTH, SOUTH.replace("0.75", "1.025"), "rooms", "no way leads into"),
    "no floor": ("house.xml", FLOOR, "", "floor", "missing"),
    "a floor too low": ("house.xml", FLOOR, FLOOR.replace("3 2 0", "3 2 -0.2"), "floor", "z = -0.200"),
    "a floor too high": ("house.xml", END, '<geom type="box" pos="3 2 0.15" size="4 3 0.15"/>' + END, "floor",
        "z = 0.300 m; move the house by -0.300 m"),
    "rooms full of furniture": ("house.xml", END, '<geom type="box" pos="3 2 1.45" size="4 3 0.35"/>' + END, "rooms",
        "a person cannot stand anywhere"),
    "a step": ("house.xml", END, '<geom type="box" pos="1.5 1 0" size="0.4 0.4 0.03"/>' + END, "floor",
        "z = 0.030"),
    "a narrow sill": ("house.xml", END, '<geom type="box" pos="3 2 0.01" size="0.01 0.4 0.02"/>' + END,
        "floor", "z = 0.030"),
    "bin 3 m up": ("house.xml", TRAY, TRAY.replace('3.6 0"', '3.6 3"'), "reach", "above the floor"),
    "bin below the floor": ("house.xml", TRAY, TRAY.replace('3.6 0"', '3.6 -0.5"'), "reach",
        "below the floor"),
    "bin outside": ("house.xml", TRAY, TRAY.replace("5.7", "9.7"), "rooms", "no room"),
    "bin in the other room": ("house.xml", TRAY, TRAY.replace("5.7", "2.7"), "rooms", "'west'"),
    "bin under a shelf": ("house.xml", END, '<geom type="box" pos="5.7 3.6 0.6" size="0.3 0.3 0.02"/>' + END,
        "reach", "over it or in it"),
    "bin in a cage": ("house.xml", END,
        '<geom type="box" pos="4.6 3.2 1" size="0.03 0.8 1"/>'
        '<geom type="box" pos="5.3 2.4 1" size="0.7 0.03 1"/>' + END, "reach", ""),
    "hidden bin": ("house.xml", END, '<geom type="box" pos="5.28 3.6 1" size="0.05 0.4 1"/>' + END, "reach",
        "cannot be seen"),
    "no volume": ("tray.xml", 'name="volume"', 'name="space"', "sites", "'volume'"),
    "no approach": ("tray.xml", 'name="approach"', 'name="spot"', "sites", "'approach'"),
    "a round volume": ("tray.xml", 'name="volume" type="box"', 'name="volume" type="sphere"', "sites",
        "not a box"),
    "a bin with a joint": ("tray.xml", '<body name="receptacle">',
        '<body name="receptacle"><joint name="lid"/>', "joints", "'lid'"),
    "a bin without a floor": ("tray.xml", BOTTOM, "", "container", "no floor"),
    "a bin with a lid": ("tray.xml", BOTTOM, BOTTOM + '<geom pos="0 0 0.31" size="0.25 0.25 0.01"/>',
        "container", "closes it"),
    "a bin without a wall": ("tray.xml", '<geom pos="0.24 0 0.15" size="0.01 0.25 0.15"/>', "", "container",
        "no wall"),
    "a bin too deep for its site": ("tray.xml", 'pos="0 0 0.2" size="0.24 0.24 0.16"',
        'pos="0 0 0.3" size="0.24 0.24 0.16"', "container", "no floor"),
    "a giant bin": ("tray.xml", 'size="0.24 0.24 0.16"', 'size="2.4 0.24 0.16"', "size", "4.8"),
    "approach inside": ("tray.xml", 'name="approach" pos="0 -0.6 0"', 'name="approach" pos="0 0 0"',
        "approach", "inside"),
    "an object for no bin": ("tray.xml", "0.24", "0.055", "capacity", "does not fit"),
    "a heavy object": ("ball.xml", 'mass="0.1"', 'mass="1000"', "mass", "1000 kg"),
}  # fmt: skip
# An L of 0.8 m, 0.3 m wide: its hull fills the corner.
_CORNERS = [(0, 0), (0.8, 0), (0.8, 0.3), (0.3, 0.3), (0.3, 0.8), (0, 0.8)]
_VERTICES = " ".join(f"{x} {y} {z}" for z in (0, 0.8) for x, y in _CORNERS)
_CAPS = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
_FACES = [(a, c, b) for a, b, c in _CAPS] + [(a + 6, b + 6, c + 6) for a, b, c in _CAPS]
_FACES += [f for a in range(6) for b in [(a + 1) % 6] for f in ((a, b, b + 6), (a, b + 6, a + 6))]
SOFA = (
    f'<asset><mesh name="sofa" vertex="{_VERTICES}" face="{" ".join(f"{a} {b} {c}" for a, b, c in _FACES)}"/></asset>'
    '<worldbody><geom name="sofa" type="mesh" mesh="sofa" pos="0.5 0.5 0.4"/>'
)
SURPRISING = {
    "a corner sofa of one mesh": ("house.xml", "<worldbody>", SOFA, "hulls", "geom 'sofa' collides as its"),
    "a lamp at 1.9 m": ("house.xml", END, '<geom type="box" pos="1.5 1 2.2" size="0.3 0.3 0.3"/>' + END,
        "headroom", "down to 1.90 m"),
    "a door of 0.6 m": ("house.xml", SOUTH, SOUTH.replace("0.75", "0.95"), "passages", "0.6"),
    "rooms that overlap": ("house.xml", 'pos="1.5 2 1" size="1.5 2 1"', 'pos="1.6 2 1" size="1.6 2 1"',
        "rooms", "overlap"),
    "a mount for nothing": ("house.xml", END, '<site name="mount:sink"/>' + END, "mounts", "mount:sink"),
    "a time step": ("house.xml", "<worldbody>", '<option timestep="0.01"/><worldbody>', "options", "is not used"),
    "wind": ("house.xml", "<worldbody>", '<option wind="5 0 0"/><worldbody>', "options", "wind"),
    "a bin in the air": ("house.xml", TRAY, TRAY.replace('3.6 0"', '3.6 0.5"'), "reach", "hangs 0.50 m"),
    "a bin that bounces": ("tray.xml", 'condim="6"', 'condim="3"', "container", "condim 3"),
}  # fmt: skip


def test_good_houses_have_no_findings(small_catalogue, catalogue):
    assert check_house(CompiledHouse(small_catalogue)) == []
    assert check_house(CompiledHouse(catalogue)) == []


@pytest.mark.parametrize("change", BROKEN)
def test_a_house_that_breaks_a_convention_is_refused_by_that_rule(change, fresh_house):
    *edit, rule, word = BROKEN[change]
    spoiled = edited(fresh_house, *edit)
    found = errors(check_house(CompiledHouse(spoiled)))
    assert any(f.rule == rule and word in str(f) for f in found), [str(f) for f in found]
    with pytest.raises(AssetError) as refused:
        sample_episode(spoiled, objects=1, seed=0)
    assert "\n" not in str(refused.value) and str(fresh_house) in str(refused.value)


@pytest.mark.parametrize("change", SURPRISING)
def test_what_only_surprises_is_a_warning(change, fresh_house):
    *edit, rule, word = SURPRISING[change]
    spoiled = edited(fresh_house, *edit)
    found = check_house(CompiledHouse(spoiled))
    assert not errors(found), [str(f) for f in errors(found)]
    assert any(f.rule == rule and word in str(f) for f in found), [str(f) for f in found]
    require_usable(compiled_house(spoiled))


def write_grid_house(folder, columns, rows, width=10.0, depth=5.0):
    """Rooms in a grid with a doorway of 1 m in the middle of every inner wall; bins and objects of the small house."""
    x_end, y_end = columns * width, rows * depth
    walls = [(x_end / 2, y, x_end / 2 + 0.1, 0.1) for y in (-0.1, y_end + 0.1)]
    walls += [(x, y_end / 2, 0.1, y_end / 2) for x in (-0.1, x_end + 0.1)]
    for i in range(columns):
        for j in range(rows):
            x, y = i * width, j * depth
            quarter = ((width - 1) / 4, (depth - 1) / 4)
            if i:
                walls += [(x, y + s * quarter[1] + (s > 1), 0.05, quarter[1]) for s in (1, 3)]
            if j:
                walls += [(x + s * quarter[0] + (s > 1), y, quarter[0], 0.05) for s in (1, 3)]
    geoms = [f'<geom type="box" pos="{x} {y} 1.25" size="{a} {b} 1.25"/>' for x, y, a, b in walls]
    keys = [(f"r{i}_{j}", (i + 0.5) * width, (j + 0.5) * depth) for i in range(columns) for j in range(rows)]
    sites = [
        f'<site name="room:{k}" type="box" pos="{x} {y} 1" size="{width / 2} {depth / 2} 1"/>'
        for k, x, y in keys
    ]
    mounts = [f'<site name="mount:{k}" pos="{x} {depth - 0.5} 0"/>' for k, x in (("crate", 1), ("tray", 4))]
    floor = f'<geom type="plane" size="{x_end} {y_end} 0.1"/>'
    (folder / "house.xml").write_text(
        f"<mujoco><worldbody>{floor}{''.join(geoms + sites + mounts)}</worldbody></mujoco>", encoding="utf-8"
    )
    catalogue = folder / "catalogue.toml"
    text = catalogue.read_text(encoding="utf-8").replace('room = "west"', 'room = "r0_0"')
    text = text.replace('room = "east"', 'room = "r0_0"').replace('west = "West room"', "")
    rooms = "\n".join(f'{k} = "Room {k}"' for k, _, _ in keys)
    catalogue.write_text(text.replace('east = "East room"', rooms), encoding="utf-8")
    return catalogue


@pytest.mark.parametrize(("columns", "rows"), [(1, 1), (6, 6)])
def test_houses_of_50_to_1800_square_metres_can_be_used(columns, rows, fresh_house):
    catalogue = write_grid_house(fresh_house.parent, columns, rows)
    report = check_path(str(catalogue))
    assert report.usable and report.facts["size"] == f"{10 * columns:.1f} x {5 * rows:.1f} m"
    assert {f.rule for f in report.findings} <= {"points"}
