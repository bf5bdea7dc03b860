"""Draw a contact sheet that shows three pieces of each kind of furniture.

`python -m tools.furniture_sheet docs/pictures/furniture.webp` draws the sheet in docs/generated-houses.md.
"""

import argparse
import math
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.generator.files import house_files
from mjsim.generator.furniture.appearance import draw_appearance
from mjsim.generator.furniture.catalogue import KINDS
from mjsim.generator.furniture.piece import Piece
from mjsim.generator.palette import draw_palette
from mjsim.generator.placements import placed
from mjsim.generator.recipe import Recipe
from mjsim.generator.space import PiecePose
from mjsim.generator.values import Furnishing, HomePlan, Placement, Rectangle, Room, Window
from mjsim.house.catalogue.generated_names import VERSION, stream
from mjsim.house.catalogue.house_ref import models_root
from mjsim.house.catalogue.model_files import read_model
from mjsim.render import Renderer
from mjsim.render.cameras import CameraPose

CELL = (112, 84)  # size of a picture in pixels
COLUMNS = 18
APART = 12.0  # distance between pieces in metres
FOVY = math.radians(38)
PIECES = 3  # number of pieces of each kind
Image = NDArray[np.uint8]


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path, help="image file to write")
    parser.add_argument("--kinds", nargs="*", default=list(KINDS), help="kinds to draw (default: all)")
    options = parser.parse_args(arguments)
    cells = [cell for kind in options.kinds for cell in pictures(kind)]
    while len(cells) % COLUMNS:
        cells.append(np.full_like(cells[0], 255))
    rows = [np.hstack(cells[i : i + COLUMNS]) for i in range(0, len(cells), COLUMNS)]
    cv2.imwrite(str(options.out), np.vstack(rows)[..., ::-1], [cv2.IMWRITE_WEBP_QUALITY, 75])


def pictures(kind: str) -> Iterator[Image]:
    """Draw three pieces of a kind of furniture. Yield RGB pictures (height, width, 3)."""
    room = Room("living_room", "living_room", kind, Rectangle(0.0, 0.0, APART * PIECES, 9.0))
    pieces: list[tuple[Piece, PiecePose]] = []
    placements: list[Placement] = []
    seed = sum(map(ord, kind))  # all pieces of a kind get the materials of the same home
    look = draw_appearance(draw_palette(seed), stream(seed, "look"))
    for i in range(PIECES):
        piece = KINDS[kind].make(stream(seed, "sheet", kind, str(i)), look)
        x = APART * (i + 0.5)
        place = PiecePose(x, 0.0 if piece.stands != "ceiling" else 1.0, 0, "south", x)
        pieces.append((piece, place))
        placements += placed(room.key, piece, place, look)
    windows = [
        Window(room.key, "south", place.along, piece.size[0], 0.95, piece.size[2])
        for piece, place in pieces
        if piece.stands == "recess"
    ]
    plan = HomePlan((room,), (), tuple(windows))
    recipe = Recipe(VERSION, seed, plan)
    files = house_files(recipe, Furnishing(tuple(placements), ()), models_root())
    with tempfile.TemporaryDirectory() as folder:
        for name, content in files.items():
            (Path(folder) / name).parent.mkdir(exist_ok=True)
            (Path(folder) / name).write_bytes(content)
        model = read_model(Path(folder) / "house.xml").compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with Renderer(model, width=2 * CELL[0], height=2 * CELL[1], profile="quality") as renderer:
        for each in pieces:
            picture = renderer.rgb(data, _camera(*each))
            yield np.asarray(cv2.resize(picture, CELL, interpolation=cv2.INTER_AREA), np.uint8)


def _camera(piece: Piece, place: PiecePose) -> CameraPose:
    """Return a camera that looks at a piece from above and from its right side."""
    w, d, h = piece.size
    low = max(0.0, h - 1.3) if piece.stands in ("hangs", "ceiling", "recess") else 0.0
    middle = np.array([place.x, place.y + (d / 2 if piece.stands != "ceiling" else 0.0), (low + h) / 2])
    away = 0.9 + 1.25 * max(w, d, h - low)
    rise = -0.35 if piece.stands == "ceiling" else 0.4
    side = np.array([0.45, 1.0, rise])
    eye = middle + away * side / np.linalg.norm(side)
    eye[2] = min(eye[2], 2.45)  # stay below the ceiling
    return CameraPose.looking_at(eye, middle, FOVY)


if __name__ == "__main__":
    main()
