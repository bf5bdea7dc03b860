"""`mjsim house`: generate or export a house, write a house with misplaced objects, or create a gallery."""

import argparse
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from experiments.cli.options import add_command, add_force, add_setting
from experiments.errors import ConfigError
from mjsim.values.episode import POINTS

MJCF, GLTF = ".xml", ".glb"
GENERATE, EXPORT, GALLERY = "generate", "export", "gallery"
HABITAT, PROCTHOR = "habitat", "procthor"

DESCRIPTION = """\
Sample a disorganized house and write it, with its episode as JSON next to it. The suffix of --out selects the format:

  .xml  self-contained MJCF, with meshes and textures in a folder next to it. Stock MuJoCo loads it:
        python -m mujoco.viewer --mjcf=house.xml
  .glb  the visible geometry as binary glTF 2.0, for Blender, three.js and other software (docs/import.md)

`mjsim house generate` generates the house of --seed in the folder --out: MJCF, textures, catalogue.toml, recipe, a
floor plan and a picture of each room. Other commands call the same house --house generated:SEED?rooms=N
(docs/generated-houses.md).

`mjsim house export` writes --house for another simulator. --format habitat writes a scene dataset to the folder --out,
with --episodes rearrangement episodes whose seeds start at --seed. --format procthor writes a floor plan to a file.
`mjsim import house` reads both formats (docs/generated-houses.md).

`mjsim house gallery SOURCE...` draws homes to the folder --out: contact sheets of ten homes each (sheet_1.png, ...),
with a floor plan and two views at eye height, and index.html, which lists the homes by rooms and area and shows each in
3D without a server. A SOURCE is a house, or a range of seeds that excludes its end: `mjsim house gallery apartment
my-house generated:0:20 'generated:7?rooms=5' --out runs/gallery`. Repeat the command to continue after an interruption;
finished homes are not drawn again."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "house", run, description=DESCRIPTION)
    parser.add_argument(
        "what",
        nargs="?",
        choices=[GENERATE, EXPORT, GALLERY],
        help="generate a house, export one, or make a gallery (default: write a disorganized house)",
    )
    parser.add_argument(
        "sources", nargs="*", metavar="SOURCE", help="for gallery: a house, or a range of seeds"
    )
    parser.add_argument(
        "--objects", type=int, default=12, metavar="N", help="number of misplaced objects, 1 to --points"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="seed of the house or episode")
    add_setting(parser, "points", default=POINTS)
    add_setting(parser, "house", default="apartment")
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        metavar="PATH",
        help="file to write (.xml or .glb); for generate, gallery and --format habitat, a folder",
    )
    parser.add_argument(
        "--rooms",
        type=int,
        metavar="N",
        help="for generate: number of rooms, 1 to 10 (default: drawn from the seed)",
    )
    parser.add_argument(
        "--format",
        choices=[HABITAT, PROCTHOR],
        default=HABITAT,
        help="for export: format (default: %(default)s)",
    )
    parser.add_argument(
        "--episodes",
        type=int,
        default=1,
        metavar="N",
        help="for export: number of episodes (default: %(default)s)",
    )
    parser.add_argument(
        "--workers",
        type=int,
        default=os.cpu_count(),
        metavar="N",
        help="for gallery: number of homes at a time (default: one per core, here %(default)s)",
    )
    parser.add_argument("--no-pictures", action="store_true", help="for generate: write no pictures")
    add_force(parser)


def run(arguments: argparse.Namespace) -> int:
    from experiments.house import House
    from experiments.record.run_directory import check_file
    from mjsim.house.scene.scene import compose

    if arguments.what == GALLERY:
        return _gallery(arguments)
    if arguments.sources:
        raise ConfigError(
            f"{arguments.sources[0]!r} is not expected here; only gallery takes names of houses"
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
    from experiments.cli.terminal import counting_bars
    from experiments.trials.design import counted
    from experiments.web.viewing.gallery import homes_of, write_gallery

    if not arguments.sources:
        raise ConfigError("gallery needs houses; name some, such as apartment or generated:0:20")
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
    from experiments.session.house_pictures import draw_house
    from mjsim.house.catalogue.model_files import copy_house

    out: Path = arguments.out
    if out.exists() and not (arguments.force and (out / "recipe.json").is_file()):
        raise ConfigError(f"{out} exists; name a new folder, or replace a generated house with --force")
    rooms = "" if arguments.rooms is None else f"?rooms={arguments.rooms}"
    house = House.load(f"generated:{arguments.seed}{rooms}")
    with _replaced(out) as folder:
        copy_house(house.catalogue.house_path, folder)
        if not arguments.no_pictures:
            draw_house(house, folder)
    print(f"{out} ({house.catalogue.name}: {len(house.rooms.labels)} rooms, {house.rooms.area:.0f} m2)")
    return 0


def _export(arguments: argparse.Namespace) -> int:
    import json

    from experiments.house import House
    from experiments.record.run_directory import check_file
    from mjsim.formats.procthor.writer import procthor_house
    from mjsim.generator.home_cache import load_catalogue
    from mjsim.generator.recipe import floor_plan_of
    from mjsim.importing import require_extra
    from mjsim.support.files import write_text_atomically

    out: Path = arguments.out
    if arguments.format == PROCTHOR:
        check_file(out, replace=arguments.force)
        plan = floor_plan_of(load_catalogue(arguments.house).house_path)
        write_text_atomically(out, json.dumps(procthor_house(plan), indent=1) + "\n")
        print(f"{out} ({len(plan.rooms)} rooms, {len(plan.doors)} doors, {len(plan.windows)} windows)")
        return 0
    require_extra()
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
    with _replaced(out) as folder:
        name = export_habitat(house.catalogue, episodes, folder)
    print(f"{out / 'scenes' / name}.scene_instance.json ({len(episodes)} episodes)")
    return 0


@contextmanager
def _replaced(out: Path) -> Iterator[Path]:
    from mjsim.support.files import exchange, work_folder

    out.parent.mkdir(parents=True, exist_ok=True)
    with work_folder(out.parent) as folder:
        yield folder
        folder.chmod(0o755)
        if out.exists():
            exchange(folder, out)
        else:
            folder.rename(out)


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
