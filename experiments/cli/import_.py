"""`mjsim import`: objects from mesh files, houses and episodes of other simulators."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from experiments.cli import import_episodes
from experiments.cli.options import HelpFormatter
from mjsim.formats.scene.source_scene import AXES, UNITS, ImportDecision, ImportOptions
from mjsim.importing import require_extra

DESCRIPTION = """\
Make an object of a mesh file: in metres and z up, closed, in convex parts, with mass, grips and a look, resting as it
would on a floor. It joins a category of a house in DIR/catalogue.toml, which every command takes as --house. What was
decided is printed and kept in DIR/NAME/report.json; DIR/NAME/preview.png shows the result (docs/import.md)."""

HOUSE = """\
Make a house of a scene of another simulator: an SDF world (Gazebo), an MJCF scene, a glTF, GLB or OBJ scene, a
scene_instance.json of Habitat, a house JSON of ProcTHOR, or a kitchen layout of RoboCasa (.yaml). Its parts become
convex, its outer walls are closed, doors stand open, rooms are found, and bins are put against walls. Then it is
checked as by `mjsim check`; every command takes DIR as --house. What was decided is printed and kept in
DIR/report.json; DIR/preview.png shows the house from above (docs/import.md)."""


def add_parser(commands: Any) -> None:
    # `help` lets completion list it; the overview has its own line.
    top = commands.add_parser(
        "import", help=None, description="Make objects, houses and episodes from files of others."
    )
    kinds = top.add_subparsers(title="what to import", metavar="KIND", required=True)
    parser = kinds.add_parser(
        "object", help="an object from a mesh", description=DESCRIPTION, formatter_class=HelpFormatter
    )
    parser.set_defaults(run=run)
    parser.add_argument("file", type=Path, metavar="FILE", help=".glb, .obj, .stl or .ply")
    add = parser.add_argument
    add("--category", required=True, metavar="NAME", help="of the house; its bin takes the object")
    add("--out", type=Path, required=True, metavar="DIR", help="folder of the catalogue, new or not")
    add("--name", metavar="NAME", help="shown to the person (default: the name of the file)")
    add(
        "--house",
        metavar="NAME",
        help="house to extend, or its catalogue.toml or folder (default: apartment)",
    )
    add("--force", action="store_true", help="replace an object of the same name")
    shape = parser.add_argument_group("what the file does not say")
    shape.add_argument("--units", choices=tuple(UNITS), help="default: m in glTF, else guessed from the size")
    shape.add_argument("--up", choices=AXES, help="default: y in glTF and OBJ, z in STL and PLY")
    shape.add_argument("--scale", type=float, default=1.0, metavar="F", help="factor on top of the unit")
    weight = shape.add_mutually_exclusive_group()
    weight.add_argument("--mass", type=float, metavar="KG", help="0.03 to 1.5 kg")
    weight.add_argument(
        "--density", type=float, metavar="D", help="kg/m3 (default: 400, and a mass that is allowed)"
    )
    _add_house(kinds)
    import_episodes.add_parser(kinds)


def _add_house(kinds: Any) -> None:
    parser = kinds.add_parser(
        "house", help="a house from a scene", description=HOUSE, formatter_class=HelpFormatter
    )
    parser.set_defaults(run=run_house)
    add = parser.add_argument
    add(
        "source",
        type=Path,
        metavar="SOURCE",
        help=".world, .sdf, .xml, .glb, .gltf, .obj, .scene_instance.json, .json (ProcTHOR) or .yaml (RoboCasa)",
    )
    add("--out", type=Path, required=True, metavar="DIR", help="folder of the house, new")
    add("--name", metavar="NAME", help="shown to the person (default: the name of the file)")
    add("--force", action="store_true", help="replace a house that was imported before")
    add(
        "--rooms",
        type=Path,
        metavar="FILE.toml",
        help="rooms as rectangles (default: those of the source, else parted where the way is narrow)",
    )
    add(
        "--models",
        type=Path,
        nargs="+",
        default=[],
        metavar="DIR",
        help="folders of the models that it names",
    )
    add("--skip-missing", action="store_true", help="leave out files that are not there, instead of refusing")
    shape = parser.add_argument_group("what the file does not say")
    shape.add_argument("--units", choices=tuple(UNITS), help="default: m, of OBJ guessed from the size")
    shape.add_argument("--up", choices=AXES, help="default: y in glTF, of OBJ guessed from the shape")
    shape.add_argument("--scale", type=float, default=1.0, metavar="F", help="factor on top of the unit")
    shape.add_argument(
        "--floor", type=float, metavar="M", help="height of the floor (default: the lowest large one)"
    )


def run(arguments: argparse.Namespace) -> int:
    require_extra()  # then trimesh, CoACD and OpenGL are loaded: other commands start fast
    from mjsim.importing.object.house_extension import Entry, HouseExtension
    from mjsim.importing.object.mesh_import import add_mesh

    entry = Entry.named(arguments.name or arguments.file.stem, arguments.category)
    options = ImportOptions(arguments.units, arguments.up, arguments.scale, arguments.mass, arguments.density)
    extension = HouseExtension(arguments.out, arguments.house)
    decisions = add_mesh(arguments.file, extension, entry, options, force=arguments.force)
    _print(entry.label, decisions)
    print(f"{extension.folder / entry.key} (mjsim run --house {extension.path} samples it)")
    return 0


def run_house(arguments: argparse.Namespace) -> int:
    require_extra()
    from mjsim.formats.scene.source_scene import HouseOptions
    from mjsim.importing.house.house_import import import_house

    options = HouseOptions(
        arguments.units,
        arguments.up,
        arguments.scale,
        arguments.floor,
        arguments.rooms,
        tuple(arguments.models),
        arguments.skip_missing,
    )
    out = arguments.out
    decisions, report = import_house(
        arguments.source, out, options, label=arguments.name, force=arguments.force
    )
    _print(out.name, decisions)
    for finding in report.findings:
        print(finding)
    print(f"{out} (mjsim run --house {out} samples it)")
    return 0


def _print(title: str, decisions: Sequence[ImportDecision]) -> None:
    """The table of what was decided, and why."""
    from rich.console import Console
    from rich.table import Table

    table = Table("", title, "why")
    for decision in decisions:
        table.add_row(decision.what, decision.choice, decision.reason)
    Console().print(table)
