"""`mjsim house`: write a disorganized house as MJCF or glTF."""

import argparse
from pathlib import Path
from typing import Any

from experiments.cli.options import add_command, add_force, add_setting
from experiments.errors import ConfigError
from mjsim.episode import POINTS

MJCF, GLTF = ".xml", ".glb"

DESCRIPTION = """\
Sample a disorganized house and write it, with the episode as JSON beside it, in the format that the ending of --out
names:

  .xml  self-contained MJCF, with meshes and textures in a folder beside it. Stock MuJoCo loads it:
        python -m mujoco.viewer --mjcf=house.xml
  .glb  what one sees of it as one file of binary glTF 2.0, for Blender, three.js and others (docs/scene-files.md)"""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser = add_command(commands, "house", run, description=DESCRIPTION)
    parser.add_argument(
        "--objects", type=int, default=12, metavar="N", help="misplaced objects, 1 to --points"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="seed of the house")
    add_setting(parser, "points", default=POINTS)
    add_setting(parser, "house", default="apartment")
    parser.add_argument(
        "--out", type=Path, required=True, metavar="FILE", help="file to write, which ends in .xml or .glb"
    )
    add_force(parser)


def run(arguments: argparse.Namespace) -> int:
    """Sample, compose, export."""
    from experiments.house import House
    from experiments.record.run_directory import check_file
    from mjsim.model.scene import compose

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


def _write(scene: Any, path: Path) -> None:
    """Write a composed scene in the format that the ending of the path names."""
    from mjsim.files import replacing
    from mjsim.model.export import export_house
    from mjsim.scene_export.export import export_episode

    if path.suffix == MJCF:
        export_house(scene, path)
        return
    content = export_episode(scene)
    with replacing(path) as temporary:
        temporary.write_bytes(content)
