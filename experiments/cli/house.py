"""`mjsim house`: write a disorganized house as MJCF."""

import argparse
from pathlib import Path
from typing import Any

from experiments.cli.options import add_command, add_force, add_setting
from experiments.errors import ConfigError
from mjsim.episode import POINTS

DESCRIPTION = """\
Sample a disorganized house and write it as self-contained MJCF: the file, its meshes and textures in a folder
beside it, and the episode as JSON. Stock MuJoCo loads it:  python -m mujoco.viewer --mjcf=house.xml"""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser = add_command(commands, "house", run, description=DESCRIPTION)
    parser.add_argument(
        "--objects", type=int, default=12, metavar="N", help="misplaced objects, 1 to --points"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="seed of the house")
    add_setting(parser, "points", default=POINTS)
    add_setting(parser, "house", default="apartment")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.xml", help="MJCF file to write")
    add_force(parser)


def run(arguments: argparse.Namespace) -> int:
    """Sample, compose, export."""
    from experiments.house import House
    from experiments.record.run_directory import check_file
    from mjsim.model.export import export_house
    from mjsim.model.scene import compose

    if arguments.out.suffix != ".xml":
        raise ConfigError(
            f"cannot export to {arguments.out}: MuJoCo reads models from files that end in .xml"
        )
    episode_file = arguments.out.with_suffix(".episode.json")
    for path in (arguments.out, episode_file):
        check_file(path, replace=arguments.force)
    house = House.load(arguments.house)
    episode = house.sample_episode(objects=arguments.objects, seed=arguments.seed, points=arguments.points)
    export_house(compose(episode, house.catalogue), arguments.out)
    episode.save(episode_file)
    print(f"{arguments.out} ({len(episode.objects)} misplaced objects, seed {arguments.seed})")
    return 0
