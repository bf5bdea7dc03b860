"""`mjsim import`: import objects from mesh files, and houses and episodes from other simulators."""

import argparse
import importlib.util
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from experiments.cli.options import add_command, add_setting
from experiments.errors import ConfigError
from mjsim.formats.scene.source_scene import AXES, UNITS, ImportDecision, ImportOptions
from mjsim.importing import require_extra
from mjsim.support.files import write_text_atomically
from mjsim.values.episode import POINTS

if TYPE_CHECKING:
    from mjsim.house.scene.disorder import Disorder
    from mjsim.importing.episodes import EpisodeObject

DESCRIPTION = """\
Import an object from a mesh file. The object is scaled to metres, turned z up, closed, divided into convex parts, given
mass, grips and colours, and laid on a floor to rest. It is added to a category of a house in DIR/catalogue.toml, which
every command accepts as --house. All decisions are printed and saved in DIR/NAME/report.json. DIR/NAME/preview.png
shows the result (docs/import.md)."""

HOUSE = """\
Import a house from a scene of another simulator: an SDF world (Gazebo), an MJCF scene, a glTF, GLB or OBJ scene, a
scene_instance.json (Habitat), a house JSON (ProcTHOR) or a kitchen layout (RoboCasa, .yaml). The scene is divided into
convex parts, its outer walls are closed, its doors opened, its rooms detected, and bins are placed against walls. Then
it is checked as by `mjsim check`, and every command accepts DIR as --house. All decisions are printed and saved in
DIR/report.json. DIR/preview.png shows the house from above (docs/import.md)."""

EPISODES = """\
Read rearrangement episodes of RoomR (AI2-THOR rearrangement, .pkl.gz) or Housekeep (.json.gz). Write to --out:
  objects.csv     every object of every episode: whether it is out of place, and how far
  disorder.json   distributions of the number and distances of misplaced objects, for mjsim.house.scene.disorder
  disorder.png    the same distributions as a figure, with the kinds of objects (needs the extra `study`)
With --episodes, also write episode_0.json, ... for `mjsim run --episode`. These have objects of --house, about as many
and about as far from their bins as in the episodes that were read (docs/import.md)."""


def add_parser(commands: Any) -> None:
    # `help=None` is needed because completion scripts omit commands that have no `help` argument.
    top = commands.add_parser(
        "import", help=None, description="Import objects, houses and episodes from files of other software."
    )
    kinds = top.add_subparsers(title="what to import", metavar="KIND", required=True)
    parser = add_command(kinds, "object", run, DESCRIPTION, "import an object from a mesh")
    parser.add_argument("file", type=Path, metavar="FILE", help=".glb, .obj, .stl or .ply")
    add = parser.add_argument
    add("--category", required=True, metavar="NAME", help="category in the house, whose bin takes the object")
    add("--out", type=Path, required=True, metavar="DIR", help="folder of the catalogue, created if missing")
    add("--name", metavar="NAME", help="name shown to participants (default: the file name)")
    add(
        "--house",
        metavar="NAME",
        help="house to extend, or its catalogue.toml or folder (default: apartment)",
    )
    add("--force", action="store_true", help="replace an object of the same name")
    shape = _add_shape(
        parser,
        units="m for glTF, else guessed from the size",
        up="y for glTF, else guessed from base and stability",
    )
    weight = shape.add_mutually_exclusive_group()
    weight.add_argument("--mass", type=float, metavar="KG", help="mass, 0.03 to 1.5 kg")
    weight.add_argument(
        "--density",
        type=float,
        metavar="D",
        help="density, kg/m3 (default: 400, within the limits of --mass)",
    )
    _add_house(kinds)
    _add_episodes(kinds)


def _add_shape(parser: argparse.ArgumentParser, units: str, up: str) -> Any:
    group = parser.add_argument_group("properties that the file does not define")
    group.add_argument("--units", choices=tuple(UNITS), help=f"unit (default: {units})")
    group.add_argument("--up", choices=AXES, help=f"vertical axis (default: {up})")
    group.add_argument("--scale", type=float, default=1.0, metavar="F", help="factor applied after the unit")
    return group


def _add_house(kinds: Any) -> None:
    parser = add_command(kinds, "house", run_house, HOUSE, "import a house from a scene")
    add = parser.add_argument
    add(
        "source",
        type=Path,
        metavar="SOURCE",
        help=".world, .sdf, .xml, .glb, .gltf, .obj, .scene_instance.json, .json (ProcTHOR) or .yaml (RoboCasa)",
    )
    add("--out", type=Path, required=True, metavar="DIR", help="new folder of the house")
    add("--name", metavar="NAME", help="name shown to participants (default: the file name)")
    add("--force", action="store_true", help="replace an imported house")
    add(
        "--rooms",
        type=Path,
        metavar="FILE.toml",
        help="rooms as rectangles (default: those of the source, else divided at narrow passages)",
    )
    add(
        "--models",
        type=Path,
        nargs="+",
        default=[],
        metavar="DIR",
        help="folders of models that the scene refers to",
    )
    add("--skip-missing", action="store_true", help="leave out missing files instead of failing")
    shape = _add_shape(parser, "m; guessed for OBJ", "y for glTF; guessed for OBJ")
    shape.add_argument(
        "--floor",
        type=float,
        metavar="M",
        help="height of the floor (default: that of the lowest large surface)",
    )


def run(arguments: argparse.Namespace) -> int:
    require_extra()
    from mjsim.importing.object.house_extension import CatalogueEntry, HouseExtension
    from mjsim.importing.object.mesh_import import add_mesh

    entry = CatalogueEntry.named(arguments.name or arguments.file.stem, arguments.category)
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
    from rich.console import Console
    from rich.table import Table

    table = Table("", title, "why")
    for decision in decisions:
        table.add_row(decision.what, decision.choice, decision.reason)
    Console().print(table)


def _add_episodes(kinds: Any) -> None:
    parser = add_command(kinds, "episodes", run_episodes, EPISODES, "measure the disorder in episodes")
    add = parser.add_argument
    add("files", type=Path, nargs="+", metavar="FILE", help="RoomR (.pkl.gz) or Housekeep (.json.gz) file")
    add("--out", type=Path, required=True, metavar="DIR", help="output folder, created if missing")
    add(
        "--episodes",
        type=int,
        default=0,
        metavar="N",
        help="number of episodes to draw in --house (default: 0)",
    )
    add_setting(parser, "house", default="apartment")
    add("--seed", type=int, default=0, metavar="S", help="seed of the first episode; later ones count up")


def run_episodes(arguments: argparse.Namespace) -> int:
    from mjsim.house.scene.disorder import Disorder
    from mjsim.importing.episodes import MISPLACED, kind_of, read_episodes

    if arguments.episodes < 0 or arguments.seed < 0:
        raise ConfigError("--episodes and --seed must not be negative")
    found = [(file, thing) for file in arguments.files for thing in read_episodes(file)]
    things = [thing for _, thing in found]
    misplaced = [thing for thing in things if thing.state == MISPLACED]
    episodes = Counter((file, t.scene, t.episode) for file, t in found)
    wrong = Counter((file, t.scene, t.episode) for file, t in found if t.state == MISPLACED)
    distances = tuple(t.distance for t in misplaced if t.distance is not None)
    disorder = Disorder(tuple(wrong[key] for key in episodes), distances)
    kinds = Counter(kind_of(t.kind) for t in misplaced)
    out: Path = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    write_text_atomically(out / "objects.csv", _table(found))
    write_text_atomically(out / "disorder.json", json.dumps(disorder.tables()) + "\n")
    if importlib.util.find_spec("matplotlib"):
        from experiments.analysis.check_picture import draw_disorder

        draw_disorder(out / "disorder.png", disorder, kinds)
    _print_summary(things, disorder, kinds)
    if arguments.episodes:
        _draw_episodes(arguments, Disorder.load(out / "disorder.json"))
    print(out)
    return 0


def _table(found: Sequence[tuple[Path, "EpisodeObject"]]) -> str:
    from experiments.record.files import csv_text

    columns = ["file", *(f.name for f in fields(found[0][1]))]
    return csv_text(columns, ([file.name, *asdict(thing).values()] for file, thing in found))


def _print_summary(things: Sequence["EpisodeObject"], disorder: "Disorder", kinds: Counter[str]) -> None:
    from mjsim.importing.episodes import IN_PLACE, MISPLACED, OPENED

    states = Counter(thing.state for thing in things)
    count = len(disorder.misplaced)
    print(f"{count} episodes in {len({t.scene for t in things})} scenes, {len(things)} objects")
    spread = ", ".join(
        f"{n} in {100 * k / count:.0f} %" for n, k in sorted(Counter(disorder.misplaced).items())
    )
    print(
        f"out of place: {states[MISPLACED]}, of {states[IN_PLACE] + states[MISPLACED]}; in an episode {spread}"
    )
    if disorder.distances:
        low, quarter, half, more, high = np.quantile(disorder.distances, (0.05, 0.25, 0.5, 0.75, 0.95))
        print(
            f"how far: median {half:.2f} m, half of them {quarter:.2f} to {more:.2f} m, "
            f"nine of ten {low:.2f} to {high:.2f} m"
        )
    if unknown := states[MISPLACED] - len(disorder.distances):
        print(f"without a distance (no right place, or fallen out of the scene): {unknown}")
    if states[OPENED]:
        print(f"open otherwise than wanted: {states[OPENED]}")
    print("most often: " + ", ".join(f"{kind} {n}" for kind, n in kinds.most_common(8)))


def _draw_episodes(arguments: argparse.Namespace, disorder: "Disorder") -> None:
    from experiments.house import House

    house = House.load(arguments.house)
    most = house.catalogue.points or POINTS
    reached = []
    for number in range(arguments.episodes):
        seed = arguments.seed + number
        episode = house.sample_episode(objects=disorder.count(seed, most), seed=seed, disorder=disorder)
        episode.save(arguments.out / f"episode_{number}.json")
        for thing in episode.objects:
            home = house.receptacles[episode.targets[thing.name]].center[:2]
            reached.append(float(np.linalg.norm(np.array(thing.point) - home)))
    low, half, high = np.quantile(reached, (0.25, 0.5, 0.75))
    print(
        f"{arguments.episodes} episodes in {house.catalogue.name}: {len(reached)} objects, "
        f"median {half:.2f} m from their bins, half of them {low:.2f} to {high:.2f} m (at least 1 m)"
    )
