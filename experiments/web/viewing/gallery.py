"""Create a gallery of homes: a folder with contact sheets, an index page, and a page for each home."""

import errno
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from experiments.errors import ConfigError, ExperimentError
from experiments.trials.design import house_names
from experiments.trials.workers import worker_pool
from experiments.web.viewing.homes import PAGE, PLAN, VIEW, GalleryHome, draw_home, home_key
from experiments.web.viewing.page import own_page
from mjsim.support.files import replacing
from mjsim.values.errors import MjsimError, RenderError

HOMES, SHEET = "homes", "sheet_{}.png"
COLUMNS, ROWS = 2, 5
GAP, CAPTION = 24, 44  # gap between cards and height of a caption, in pixels
WIDTH, HEIGHT = PLAN[0] + VIEW[0], PLAN[1] + CAPTION  # size of the card that shows a home, in pixels
INK, QUIET, PAPER = (22, 33, 43), (74, 85, 96), 255
Image = NDArray[np.uint8]


def homes_of(sources: Sequence[str]) -> Mapping[str, str]:
    """Return a mapping from gallery folders to the names of homes, without duplicates.

    Raises:
        AssetError, HouseError: A source is not a house.
        ConfigError: Two houses would have the same folder.
    """
    found: dict[str, str] = {}
    for name in house_names(list(sources)):
        key = home_key(name)
        if (other := found.setdefault(key, name)) != name:
            raise ConfigError(f"{other} and {name} are both called {key}; rename one of the folders")
    return found


def write_gallery(
    homes: Mapping[str, str], out: Path, *, workers: int, on_home: Callable[[str | None], None]
) -> int:
    """Draw all missing homes of a gallery, then its contact sheets and index page. Return the number of failures.

    Args:
        out: A new folder, or the folder of an existing gallery.
        on_home: Called after each home with None, or with an error message if drawing failed.

    Raises:
        ConfigError: `out` contains other files.
        RenderError: This machine cannot render.
        OSError: A file cannot be written.
    """
    if out.exists() and not (out / HOMES).is_dir() and (not out.is_dir() or any(out.iterdir())):
        raise ConfigError(f"{out} exists and is no gallery; name a new folder")
    (out / HOMES).mkdir(parents=True, exist_ok=True)
    drawn = {}
    for key, home in _drawn(homes, out / HOMES, workers):
        if isinstance(home, GalleryHome):
            drawn[key] = home
        on_home(None if isinstance(home, GalleryHome) else f"{homes[key]}: {home}")
    shown = [(drawn[key], out / HOMES / key) for key in homes if key in drawn]
    count = 0
    for count, sheet in enumerate(sheets(shown), 1):
        with replacing(out / SHEET.format(count)) as temporary:
            cv2.imwrite(str(temporary), sheet[..., ::-1])
    number = count + 1
    while (old := out / SHEET.format(number)).is_file():  # contact sheets that remain from a larger gallery
        old.unlink()
        number += 1
    page = own_page("gallery", "gallery.js", homes=[(home, f"{HOMES}/{f.name}") for home, f in shown])
    with replacing(out / PAGE) as temporary:
        temporary.write_text(page, "utf-8")
    return len(homes) - len(shown)


def _drawn(
    homes: Mapping[str, str], folder: Path, workers: int
) -> Iterator[tuple[str, GalleryHome | Exception]]:
    with worker_pool(min(workers, len(homes))) as pool:
        running = {pool.submit(draw_home, name, folder / key): key for key, name in homes.items()}
        for future in as_completed(running):
            error = future.exception()
            if error is not None and (
                isinstance(error, RenderError) or not isinstance(error, MjsimError | ExperimentError)
            ):
                raise error
            yield running[future], error if isinstance(error, Exception) else future.result()


def sheets(homes: Sequence[tuple[GalleryHome, Path]]) -> Iterator[Image]:
    """Yield RGB contact sheets of up to ten homes. `homes` pairs each home with its picture folder."""
    for first in range(0, len(homes), COLUMNS * ROWS):
        cards = [_card(home, folder) for home, folder in homes[first : first + COLUMNS * ROWS]]
        rows = -(-len(cards) // COLUMNS)
        across = min(COLUMNS, len(cards))
        sheet = np.full((GAP + rows * (HEIGHT + GAP), GAP + across * (WIDTH + GAP), 3), PAPER, np.uint8)
        for number, card in enumerate(cards):
            row, column = divmod(number, COLUMNS)
            top, left = GAP + row * (HEIGHT + GAP), GAP + column * (WIDTH + GAP)
            sheet[top : top + HEIGHT, left : left + WIDTH] = card
        yield sheet


def _card(home: GalleryHome, folder: Path) -> Image:
    card = np.full((HEIGHT, WIDTH, 3), PAPER, np.uint8)
    plan, *views = (_picture(folder / name) for name in home.pictures)
    height, width = plan.shape[:2]
    card[CAPTION : CAPTION + height, :width] = plan
    for number, view in enumerate(views):
        top = CAPTION + number * VIEW[1]
        card[top : top + VIEW[1], PLAN[0] :] = cv2.resize(view, VIEW, interpolation=cv2.INTER_AREA)
    face, base = cv2.FontFace("sans"), CAPTION - 16
    (end, _), _ = cv2.putText(card, f"{home.label}  ", (0, base), INK, face, 22, 650)
    cv2.putText(card, f"{home.size}, {home.origin}", (end, base), QUIET, face, 20, 400)
    return card


def _picture(path: Path) -> Image:
    picture = cv2.imread(str(path))
    if picture is None:
        raise OSError(errno.EIO, "is no picture; remove its folder, and it is drawn again", str(path))
    return np.asarray(picture[..., ::-1], np.uint8)
