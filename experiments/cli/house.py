"""`mjsim house`: write a disorganized house as MJCF or glTF, generate a house, export one, or show many."""

import argparse
import os
from pathlib import Path
from typing import Any

from experiments.cli.options import add_command, add_force, add_setting
from experiments.errors import ConfigError
from mjsim.values.episode import POINTS

MJCF, GLTF = ".xml", ".glb"
GENERATE, EXPORT, GALLERY = "generate", "export", "gallery"
HABITAT, PROCTHOR = "habitat", "procthor"

DESCRIPTION = """\
Sample a disorganized house and write it, with the episode as JSON beside it, in the format that the ending of --out
names:

  .xml  self-contained MJCF, with meshes and textures in a folder beside it. Stock MuJoCo loads it:
        python -m mujoco.viewer --mjcf=house.xml
  .glb  what one sees of it as one file of binary glTF 2.0, for Blender, three.js and others (docs/import.md)

With `generate`: make the house of the seed --seed as the folder --out, with MJCF, textures, catalogue.toml, recipe, a
floor plan and a picture of each room. --house generated:SEED?rooms=N names the same house (docs/generated-houses.md).

With `export`: write the house --house for another simulator. --format habitat makes a scene dataset in the folder
--out, with --episodes episodes of rearrangement from --seed on; --format procthor makes a file of the floor plan.
`mjsim import house` reads both back (docs/generated-houses.md).

With `gallery SOURCE...`: draw homes into the folder --out: contact sheets of ten homes each (sheet_1.png, ...) with a
floor plan and two views at eye height, and index.html, which lists them by rooms and area and opens each in three
dimensions, without a server. A SOURCE is a house, or generated ones of a range of seeds whose end is not included:
`mjsim house gallery apartment my-house generated:0:20 'generated:7?rooms=5' --out runs/gallery`. The same command
continues after an interruption; homes that are there are not drawn again."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "house", run, description=DESCRIPTION)
    parser.add_argument(
        "what",
        nargs="?",
        choices=[GENERATE, EXPORT, GALLERY],
        help="make a new house, export one, or show many",
    )
    parser.add_argument(
        "sources", nargs="*", metavar="SOURCE", help="of gallery: a house, or a range of seeds"
    )
    parser.add_argument(
        "--objects", type=int, default=12, metavar="N", help="misplaced objects, 1 to --points"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="seed of the house")
    add_setting(parser, "points", default=POINTS)
    add_setting(parser, "house", default="apartment")
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        metavar="PATH",
        help="file to write, which ends in .xml or .glb; of generate, gallery and --format habitat, a folder",
    )
    parser.add_argument(
        "--rooms",
        type=int,
        metavar="N",
        help="rooms of the house to generate, 1 to 10 (default: as the seed says)",
    )
    parser.add_argument(
        "--format", choices=[HABITAT, PROCTHOR], default=HABITAT, help="of export (default: %(default)s)"
    )
    parser.add_argument(
        "--episodes", type=int, default=1, metavar="N", help="of export (default: %(default)s)"
    )
    parser.add_argument(
        "--workers",
        type=int,
        default=os.cpu_count(),
        metavar="N",
        help="of gallery: homes at a time (default: one per core, %(default)s here)",
    )
    parser.add_argument("--no-pictures", action="store_true", help="generate without pictures")
    add_force(parser)


def run(arguments: argparse.Namespace) -> int:
    from experiments.house import House
    from experiments.record.run_directory import check_file
    from mjsim.house.scene.scene import compose

    if arguments.what == GALLERY:
        return _gallery(arguments)
    if arguments.sources:
        raise ConfigError(
            f"{arguments.sources[0]!r} is one word too many; only gallery takes names of houses here"
        )
    if arguments.what == GENERATE:
        return _generate(arguments)
    if arguments.what == EXPORT:
        return _export(arguments)
    if arguments.out.suffix not in (MJCF, GLTF):
        raise ConfigError(
            f"cannot export to {arguments.out}: name a file that ends in {MJCF} (MJCF, for MuJoCo) or {GLTF} (glTF)"
        )
    episode_file = arguments.out.with_suffix(".episode.json")
    for path in (arguments.out, episode_file):
        check_file(path, replace=arguments.force)
    house = House.load(arguments.house)
    episode = house.sample_episode(objects=arguments.objects, seed=arguments.seed, points=arguments.points)
    _write(compose(episode, house.catalogue), arguments.out)
    episode.save(episode_file)
    print(f"{arguments.out} ({len(episode.objects)} misplaced objects, seed {arguments.seed})")
    return 0


def _gallery(arguments: argparse.Namespace) -> int:
    """Draw homes, with a progress bar; 1 if one of them failed."""
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    from experiments.cli.terminal import error_console, progress_bars
    from experiments.trials.design import counted
    from experiments.web.viewing.gallery import homes_of, write_gallery

    if not arguments.sources:
        raise ConfigError("a gallery needs houses: name some, such as apartment or generated:0:20")
    homes, out = homes_of(arguments.sources), arguments.out
    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with progress_bars(error_console(), "homes", *columns) as bars:
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
    """Write the house of a seed into a folder, checked, with pictures: whole or not at all."""
    from experiments.house import House
    from experiments.session.house_pictures import draw_house
    from mjsim.house.catalogue.model_files import copy_house
    from mjsim.support.files import exchange, work_folder

    out: Path = arguments.out
    if out.exists() and not (arguments.force and (out / "recipe.json").is_file()):
        raise ConfigError(f"{out} exists; name a new folder, or replace a generated house with --force")
    rooms = "" if arguments.rooms is None else f"?rooms={arguments.rooms}"
    house = House.load(f"generated:{arguments.seed}{rooms}")
    out.parent.mkdir(parents=True, exist_ok=True)
    with work_folder(out.parent) as folder:
        copy_house(house.catalogue.house_path, folder)
        if not arguments.no_pictures:
            draw_house(house, folder)
        folder.chmod(0o755)
        if out.exists():
            exchange(folder, out)
        else:
            folder.rename(out)
    print(f"{out} ({house.catalogue.name}: {len(house.rooms.labels)} rooms, {house.rooms.area:.0f} m2)")
    return 0


def _export(arguments: argparse.Namespace) -> int:
    """Write a house for another simulator: whole or not at all."""
    import json

    from experiments.house import House
    from experiments.record.run_directory import check_file
    from mjsim.formats.procthor.writer import procthor_house
    from mjsim.generator.home_cache import load_catalogue
    from mjsim.generator.recipe import floor_plan_of
    from mjsim.importing import require_extra
    from mjsim.support.files import exchange, work_folder, write_text_atomically

    out: Path = arguments.out
    if arguments.format == PROCTHOR:
        check_file(out, replace=arguments.force)
        plan = floor_plan_of(load_catalogue(arguments.house).house_path)
        write_text_atomically(out, json.dumps(procthor_house(plan), indent=1) + "\n")
        print(f"{out} ({len(plan.rooms)} rooms, {len(plan.doors)} doors, {len(plan.windows)} windows)")
        return 0
    require_extra()  # then trimesh is loaded
    from mjsim.formats.habitat_writer import export_habitat

    if arguments.episodes < 0:
        raise ConfigError(f"{arguments.episodes} episodes cannot be sampled; give 0 or more")
    if out.exists() and not (arguments.force and list(out.glob("*.scene_dataset_config.json"))):
        raise ConfigError(f"{out} exists; name a new folder, or replace an exported house with --force")
    house = House.load(arguments.house)
    seeds = range(arguments.seed, arguments.seed + arguments.episodes)
    episodes = [
        house.sample_episode(objects=arguments.objects, seed=seed, points=arguments.points) for seed in seeds
    ]
    out.parent.mkdir(parents=True, exist_ok=True)
    with work_folder(out.parent) as folder:
        name = export_habitat(house.catalogue, episodes, folder)
        folder.chmod(0o755)
        if out.exists():
            exchange(folder, out)
        else:
            folder.rename(out)
    print(f"{out / 'scenes' / name}.scene_instance.json ({len(episodes)} episodes)")
    return 0


def _write(scene: Any, path: Path) -> None:
    """Write a composed scene in the format that the ending of the path names."""
    from mjsim.formats.gltf.export import export_episode
    from mjsim.formats.mjcf_writer import export_house
    from mjsim.support.files import replacing

    if path.suffix == MJCF:
        export_house(scene, path)
        return
    content = export_episode(scene)
    with replacing(path) as temporary:
        temporary.write_bytes(content)
