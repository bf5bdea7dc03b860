"""Draw a contact sheet of ten generated homes, with 1 to 10 rooms.

`python -m tools.homes_sheet docs/pictures/homes.webp` draws the sheet in docs/generated-houses.md.
"""

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from experiments.web.viewing.gallery import sheets
from experiments.web.viewing.homes import draw_home

FIRST_SEED = 7


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path, help="image file to write")
    out = parser.parse_args(arguments).out
    homes = []
    with tempfile.TemporaryDirectory() as folder:
        for rooms in range(1, 11):
            home = Path(folder) / str(rooms)
            homes.append((draw_home(f"generated:{FIRST_SEED + rooms}?rooms={rooms}", home), home))
        (sheet,) = sheets(homes)
    cv2.imwrite(str(out), np.ascontiguousarray(sheet[..., ::-1]), [cv2.IMWRITE_WEBP_QUALITY, 75])


if __name__ == "__main__":
    main()
