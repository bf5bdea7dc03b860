"""Generate the procedural textures and the meshes of objects: `python -m tools.authoring [models folder]`."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from tools.authoring.objects import build_meshes
from tools.authoring.textures import build_textures


def main(arguments: Sequence[str] | None = None) -> int:
    """Write all generated files and print their number. Return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tools.authoring", description=__doc__)
    default = Path(__file__).resolve().parents[2] / "models"
    parser.add_argument("models", nargs="?", type=Path, default=default, help="models folder (%(default)s)")
    models: Path = parser.parse_args(arguments).models
    if not models.is_dir():
        parser.error(f"{models} is not a folder; name the checkout's models folder")
    textures = build_textures(models / "textures")
    sys.stdout.write(f"{len(textures)} textures in {models / 'textures'}\n")
    meshes = build_meshes(models)
    sys.stdout.write(f"{len(meshes)} meshes and labels in {models}\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
