"""Golden pictures of the three conditions and of the hands, with the world-locked markers projected onto them.

Run this file as a script to draw them anew, then look at them before committing.
"""

import dataclasses
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from hud import sample
from hud.compose import compose
from hud.conditions import condition
from hud.messages import message
from hud.projection import project
from hud.state import HudState, Marker, Pointer

FOLDER = Path(__file__).parent / "golden"
DRAWN_WITH = "5.0.0"  # OpenCV version of the files; another may hint glyphs differently
SIZE = (640, 480)
CLOSE_ENOUGH = 45.0  # dB


def states() -> dict[str, HudState]:
    def state(name: str, count: int, steps: int, key: str | None, **labels: str) -> HudState:
        bar = None if key is None else message(key, **labels)
        return condition(name)(sample.task(count, steps=steps, message=bar))

    return {
        "none": state("none", 12, 1, "picked", object="Blue mug"),
        "highlight": state("highlight", 12, 6, "hands_full"),
        "optimal": state("optimal", 24, 4, "replanned"),
        "hands_empty": state("none", 6, 0, None),
        "hands_full": state("none", 6, 2, "nothing_in_reach"),
    }


def with_markers(frame: NDArray[np.uint8], markers: tuple[Marker, ...], dots: int = 5) -> NDArray[np.uint8]:
    """Draw markers as discs along their height: enough to see where they are, what size and what colour."""
    camera = sample.camera(*SIZE)
    out = frame.copy()
    for marker in markers:
        length = marker.size[1] if marker.shape == "cylinder" else 0.0
        across = max(marker.size) if marker.shape == "box" else marker.size[0]
        for offset in np.linspace(-length, length, dots if length else 1):
            (pixel,), (depth,) = project(camera, [np.add(marker.position, (0.0, 0.0, offset))])
            if depth < 0.3:
                continue
            centre = np.rint(16.0 * pixel).astype(int)
            radius = max(16, round(16.0 * across * camera.focal / depth))
            colour = tuple(round(255 * c) for c in marker.rgba[:3])
            cv2.circle(out, (int(centre[0]), int(centre[1])), radius, colour, -1, cv2.LINE_8, 4)
    return out


def draw(state: HudState) -> NDArray[np.uint8]:
    return compose(with_markers(sample.backdrop(*SIZE), state.markers), state, sample.pictures())


def load(name: str) -> NDArray[np.uint8]:
    image = cv2.imread(str(FOLDER / f"hud_{name}.png"), cv2.IMREAD_COLOR_RGB)
    assert image is not None, f"golden picture of {name} is missing"
    return np.asarray(image, dtype=np.uint8)


def psnr(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> float:
    error = np.mean((a.astype(np.float64) - b) ** 2)
    return float("inf") if error == 0 else float(10.0 * np.log10(255.0**2 / error))


@pytest.mark.parametrize("name", sorted(states()))
def test_pictures_are_as_they_were(name: str) -> None:
    drawn, golden = draw(states()[name]), load(name)
    if cv2.__version__ == DRAWN_WITH:
        assert int(np.abs(drawn.astype(int) - golden).max()) <= 1, (
            "one level is rounding of vector instructions"
        )
    assert psnr(drawn, golden) > CLOSE_ENOUGH


def moved_breadcrumb(state: HudState) -> HudState:
    first, *rest = state.markers
    x, y, z = first.position
    return dataclasses.replace(state, markers=(dataclasses.replace(first, position=(x + 0.05, y, z)), *rest))


def with_row(state: HudState, index: int, **change: object) -> HudState:
    rows = list(state.checklist)
    rows[index] = dataclasses.replace(rows[index], **change)  # type: ignore[arg-type]
    return dataclasses.replace(state, checklist=tuple(rows))


def swapped_hands(state: HudState) -> HudState:
    left, right = state.inventory
    return dataclasses.replace(state, inventory=(right, left))


MUTATIONS = {
    "a breadcrumb moves by 5 cm": ("optimal", moved_breadcrumb),
    "a label changes": ("optimal", lambda s: with_row(s, 4, text="Blue jug")),
    "a step is no longer crossed out": ("optimal", lambda s: with_row(s, 3, done=False)),
    "the hands change places": ("none", swapped_hands),
    "a flag is missing": ("highlight", lambda s: dataclasses.replace(s, markers=s.markers[4:])),
    "the title changes": ("none", lambda s: dataclasses.replace(s, checklist_title="Objects to find")),
    "the list has another order": ("none", lambda s: dataclasses.replace(s, checklist=s.checklist[::-1])),
    "the message changes": ("hands_full", lambda s: dataclasses.replace(s, message=message("out_of_reach"))),
    "a place changes": (
        "highlight",
        lambda s: dataclasses.replace(s, bins=(dataclasses.replace(s.bins[0], place="Attic"), *s.bins[1:])),
    ),
    "a pointer appears": ("optimal", lambda s: dataclasses.replace(s, pointer=Pointer(0.5))),
}


@pytest.mark.parametrize("what", sorted(MUTATIONS))
def test_the_tolerance_would_catch_a_change(what: str) -> None:
    name, mutate = MUTATIONS[what]
    assert psnr(draw(mutate(states()[name])), load(name)) < CLOSE_ENOUGH


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, state in states().items():
        cv2.imwrite(str(FOLDER / f"hud_{name}.png"), cv2.cvtColor(draw(state), cv2.COLOR_RGB2BGR))
