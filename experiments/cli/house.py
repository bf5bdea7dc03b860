"""`mjsim house`: write a house with misplaced objects, generate or export a house, or create a gallery."""

import argparse
import os
from pathlib import Path
from typing import Any

from experiments.cli.options import add_command, add_force, add_setting, given_options
from experiments.cli.server import number
from experiments.errors import ConfigError
from mjsim.values.episode import POINTS

MJCF, GLTF = ".xml", ".glb"
HABITAT, PROCTHOR = "habitat", "procthor"
OBJECTS, MAX_COUNT = 12, 100_000  # default number of misplaced objects; largest number of homes or episodes
SAMPLED = ("objects", "points", "seed", "episodes")  # options that only apply to exports with episodes

SAMPLE = """\
Sample a disorganized house and write it, with its episode as JSON next to it. The suffix of --out selects the format:

  .xml  self-contained MJCF, with meshes and textures in a folder next to it. Stock MuJoCo loads it:
        python -m mujoco.viewer --mjcf=house.xml
  .glb  the visible geometry as binary glTF 2.0, for Blender, three.js and other software (docs/import.md)

Each of the commands below has its own options: `mjsim house generate --help`."""

GENERATE = """\
Generate the house of --seed in the folder --out: MJCF, textures, catalogue.toml, recipe, a floor plan and a picture of
each room. Other commands call the same house --house generated:SEED?rooms=N (docs/generated-houses.md)."""

EXPORT = """\
Write --house for another simulator. --format habitat writes a scene dataset to the folder --out, with --episodes
rearrangement episodes whose seeds start at --seed. --format procthor writes a floor plan to a file. `mjsim import
house` reads both formats (docs/generated-houses.md)."""

GALLERY = """\
Draw homes to the folder --out: contact sheets of ten homes each (sheet_1.png, ...), with a floor plan and two views at
eye height, and index.html, which lists the homes by rooms and area and shows each in 3D without a server. A SOURCE is a
house, or a range of seeds that excludes its end: `mjsim house gallery apartment my-house generated:0:20
'generated:7?rooms=5' --out runs/gallery`. Repeat the command to continue after an interruption; finished homes are not
drawn again."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "house", run, SAMPLE)
    _add_episode(parser, OBJECTS)
    parser.add_argument("--out", type=Path, metavar="PATH", help="file to write, .xml or .glb (required)")
    add_force(parser)
    kinds = parser.add_subparsers(title="other commands", metavar="COMMAND", action=_Commands)
    one = add_command(kinds, "generate", _generate, GENERATE, "generate a house")
    one.add_argument("--seed", type=int, default=0, metavar="S", help="seed of the house")
    rooms = "number of rooms, 1 to 10 (default: drawn from the seed)"
    one.add_argument("--rooms", type=int, metavar="N", help=rooms)
    one.add_argument("--no-pictures", action="store_true", help="write no pictures")
    _add_out(one, "folder to create")
    one = add_command(kinds, "export", _export, EXPORT, "export a house")
    one.add_argument("--format", choices=[HABITAT, PROCTHOR], default=HABITAT, help="format")
    _add_episode(one, None)
    one.add_argument(
        "--episodes", type=number(1, MAX_COUNT), metavar="N", help="number of episodes (default: 1)"
    )
    _add_out(one, "folder to create, or file to write (procthor)")
    one = add_command(kinds, "gallery", _gallery, GALLERY, "draw homes")
    one.add_argument("sources", nargs="+", metavar="SOURCE", help="a house, or a range of seeds")
    cores = f"number of homes at a time (default: one per core, here {os.cpu_count()})"
    one.add_argument("--workers", type=number(1, MAX_COUNT), default=os.cpu_count(), metavar="N", help=cores)
    one.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the gallery")


def _add_episode(parser: argparse.ArgumentParser, objects: int | None) -> None:
    add_setting(parser, "house", default="apartment")
    text = f"number of misplaced objects, 1 to --points (default: {OBJECTS})"
    parser.add_argument("--objects", type=int, default=objects, metavar="N", help=text)
    seed = None if objects is None else 0
    parser.add_argument(
        "--seed", type=int, default=seed, metavar="S", help="seed of the episode (default: 0)"
    )
    add_setting(parser, "points", **({} if objects is None else {"default": POINTS}))


def _add_out(parser: argparse.ArgumentParser, text: str) -> None:
    parser.add_argument("--out", type=Path, required=True, metavar="PATH", help=text)
    add_force(parser)


class _Commands(argparse._SubParsersAction):  # type: ignore[type-arg]  # argparse has no public name for the class
    """Subcommands that refuse options of the parent command, which would have no effect."""

    def __call__(self, parser: Any, namespace: Any, values: Any, option_string: Any = None) -> None:
        for action in parser._actions:
            if action.option_strings and getattr(namespace, action.dest, action.default) != action.default:
                option, command = action.option_strings[0], values[0]
                parser.error(
                    f"{option} has no effect before {command}; put the options of {command} after it"
                )
        super().__call__(parser, namespace, values, option_string)


def run(arguments: argparse.Namespace) -> int:
    from experiments.house import House
    from experiments.record.run_directory import check_file
    from mjsim.house.scene.scene import compose

    out: Path | None = arguments.out
    if out is None or out.suffix not in (MJCF, GLTF):
        raise ConfigError(
            f"--out is {'missing' if out is None else out}; name a file that ends in {MJCF} (MJCF, for MuJoCo) or "
            f"{GLTF} (glTF)"
        )
    check_file(out, replace=arguments.force)
    house = House.load(arguments.house)
    episode = house.sample_episode(objects=arguments.objects, seed=arguments.seed, points=arguments.points)
    episode_file = out.with_suffix(".episode.json")
    if not _holds(episode_file, episode.to_json()):  # a file that was written with the other format may stay
        check_file(episode_file, replace=arguments.force)
    _write(compose(episode, house.catalogue), out)
    episode.save(episode_file)
    print(f"{out} ({len(episode.objects)} misplaced objects, seed {arguments.seed})")
    return 0


def _holds(path: Path, text: str) -> bool:
    from mjsim.support.files import is_file, read_bytes

    return is_file(path) and read_bytes(path) == text.encode()


def _gallery(arguments: argparse.Namespace) -> int:
    from experiments.cli.terminal import counting_bars
    from experiments.trials.design import counted
    from experiments.web.viewing.gallery import homes_of, write_gallery

    homes, out = homes_of(arguments.sources), arguments.out
    with counting_bars("homes") as bars:
        bar = bars.add_task("homes", total=len(homes))

        def show(failure: str | None) -> None:
            bars.advance(bar)
            if failure:
                bars.console.print(f"failed: {failure}", style="red", soft_wrap=True)

        failed = write_gallery(homes, out, workers=arguments.workers, on_home=show)
    drawn = counted(len(homes) - failed, "home")
    print(f"{out / 'index.html'} ({drawn}{f', {failed} failed' if failed else ''})")
    return 1 if failed else 0


def _generate(arguments: argparse.Namespace) -> int:
    from experiments.house import House
    from experiments.record.files import replacing_folder
    from experiments.session.house_pictures import draw_house
    from mjsim.house.catalogue.model_files import copy_house

    out: Path = arguments.out
    if os.path.lexists(out) and not (arguments.force and (out / "recipe.json").is_file()):
        raise ConfigError(f"{out} exists; name a new folder, or replace a generated house with --force")
    rooms = "" if arguments.rooms is None else f"?rooms={arguments.rooms}"
    house = House.load(f"generated:{arguments.seed}{rooms}")
    with replacing_folder(out) as folder:
        copy_house(house.catalogue.house_path, folder)
        if not arguments.no_pictures:
            draw_house(house, folder)
    print(f"{out} ({house.catalogue.name}: {len(house.rooms.labels)} rooms, {house.rooms.area:.0f} m2)")
    return 0


def _export(arguments: argparse.Namespace) -> int:
    return _export_floor_plan(arguments) if arguments.format == PROCTHOR else _export_dataset(arguments)


def _export_floor_plan(arguments: argparse.Namespace) -> int:
    import json

    from experiments.record.run_directory import check_file
    from mjsim.formats.procthor.writer import procthor_house
    from mjsim.generator.home_cache import load_catalogue
    from mjsim.generator.recipe import floor_plan_of
    from mjsim.support.files import write_text_atomically

    out: Path = arguments.out
    if given := [name for name in SAMPLED if getattr(arguments, name) is not None]:
        raise ConfigError(
            f"--{given[0]} has no effect with --format {PROCTHOR}, which has no objects; leave it out"
        )
    check_file(out, replace=arguments.force)
    plan = floor_plan_of(load_catalogue(arguments.house).house_path)
    write_text_atomically(out, json.dumps(procthor_house(plan), indent=1) + "\n")
    print(f"{out} ({len(plan.rooms)} rooms, {len(plan.doors)} doors, {len(plan.windows)} windows)")
    return 0


def _export_dataset(arguments: argparse.Namespace) -> int:
    from experiments.house import House
    from mjsim.importing import require_extra

    require_extra()
    from experiments.record.files import replacing_folder
    from mjsim.formats.habitat_writer import export_habitat

    out: Path = arguments.out
    if out.exists() and not (arguments.force and list(out.glob("*.scene_dataset_config.json"))):
        raise ConfigError(f"{out} exists; name a new folder, or replace an exported house with --force")
    house = House.load(arguments.house)
    first = arguments.seed or 0
    given = given_options(arguments, ("objects", "points"))
    settings = {"objects": OBJECTS, "points": POINTS, **given}
    seeds = range(first, first + (arguments.episodes or 1))
    episodes = [house.sample_episode(seed=seed, **settings) for seed in seeds]
    with replacing_folder(out) as folder:
        name = export_habitat(house.catalogue, episodes, folder)
    print(f"{out / 'scenes' / name}.scene_instance.json ({len(episodes)} episodes)")
    return 0


def _write(scene: Any, path: Path) -> None:
    from mjsim.formats.gltf.export import export_episode
    from mjsim.formats.mjcf_writer import export_house
    from mjsim.support.files import replacing

    if path.suffix == MJCF:
        export_house(scene, path)
        return
    content = export_episode(scene)
    with replacing(path) as temporary:
        temporary.write_bytes(content)
