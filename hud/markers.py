"""Breadcrumbs, flagpoles and pins, which are virtual objects in the house (PAPER section 5)."""

import functools

import numpy as np
from numpy.typing import NDArray

from hud.state import HudState, Marker, Rgba, Shape, Vec2, Vec3

CHEST = 0.75  # height of the first breadcrumb as a fraction of the eye height
BREADCRUMB_RADIUS = 0.04  # radius of a breadcrumb in metres, at which it is 7 pixels wide 5 m away
BREADCRUMB_SPACING = 0.28  # distance between breadcrumbs along the floor path, in metres

RIM_RADIUS = 1.3  # radius of the white rim as a multiple of the breadcrumb's radius

# Roles of markers.
BREADCRUMB = "breadcrumb"
RIM = "rim"
FLAGPOLE = "flagpole"
GOAL = "goal"
BIN = "bin"
POLE_BANDS = 4

RED: Rgba = (0.90, 0.10, 0.06, 1.0)
YELLOW: Rgba = (1.0, 0.86, 0.10, 1.0)
NAVY: Rgba = (0.03, 0.06, 0.20, 1.0)
WHITE: Rgba = (0.95, 0.95, 0.95, 1.0)
SKY: Rgba = (0.34, 0.71, 0.91, 1.0)


def breadcrumbs(path: NDArray[np.float64], eye_height: float, clearance: float = 0.0) -> tuple[Marker, ...]:
    """Return spheres along a floor path that descend from chest height to the floor (PAPER section 5).

    The path has shape (k, 2), in metres. Its first `clearance` metres contain no spheres.
    """
    chest = CHEST * eye_height
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    length = float(along[-1])
    count = max(0, int((length - clearance) / BREADCRUMB_SPACING + 1e-9)) + 1
    at = length - BREADCRUMB_SPACING * np.arange(count - 1, -1, -1)
    heights = chest + (BREADCRUMB_RADIUS - chest) * at / length if length > 0.0 else [BREADCRUMB_RADIUS]
    xs, ys = (np.interp(at, along, path[:, axis]) for axis in (0, 1))
    return tuple(
        Marker(
            "sphere",
            (float(x), float(y), float(z)),
            (BREADCRUMB_RADIUS, 0.0, 0.0),
            RED,
            BREADCRUMB,
            outlined=True,
        )
        for x, y, z in zip(xs, ys, heights, strict=True)
    )


def rims(crumbs: tuple[Marker, ...]) -> tuple[Marker, ...]:
    """Return a white disc for each breadcrumb, for participants who cannot distinguish red from brown."""
    return tuple(
        Marker("cylinder", crumb.position, (RIM_RADIUS * crumb.size[0], 0.003, 0.0), WHITE, RIM, crumb.x_ray)
        for crumb in crumbs
    )


@functools.lru_cache(maxsize=1024)  # most objects do not move from one state to the next
def flagpole(
    position: Vec3, *, object: str | None = None, low: bool = False, x_ray: bool = False
) -> tuple[Marker, ...]:
    """Return the markers of a striped pole with a flag, 1.2 m tall, over an object.

    If `low` is True, the pole has half the height and no flag. If `x_ray` is True, walls do not hide it.
    """
    x, y, z = position
    foot, top = z + 0.25, z + (0.85 if low else 1.45)
    band = (top - foot) / POLE_BANDS

    def part(shape: Shape, centre: Vec3, size: Vec3, rgba: Rgba) -> Marker:
        return Marker(shape, centre, size, rgba, FLAGPOLE, x_ray, object)

    parts = [
        part("cylinder", (x, y, foot + (i + 0.5) * band), (0.013, band / 2, 0.0), (NAVY, WHITE)[i % 2])
        for i in range(POLE_BANDS)
    ]
    for height, half, colour in () if low else ((top - 0.06, 0.06, YELLOW), (top - 0.15, 0.03, NAVY)):
        parts.append(part("box", (x, y + 0.11, height), (0.006, 0.11, half), colour))
        parts.append(part("box", (x + 0.11, y, height), (0.11, 0.006, half), colour))
    return (*parts, part("sphere", (x, y, foot), (0.03, 0.0, 0.0), YELLOW))


def flagpoles(state: HudState) -> dict[str, Vec2]:
    """Return the floor position of each flagpole in metres, by object name.

    Simulated participants find flagpoles only with this function, so they have no information beyond the HUD.
    """
    return {
        marker.object: marker.position[:2]
        for marker in state.markers
        if marker.role == FLAGPOLE
        and marker.object is not None
        and marker.shape != "box"  # ignore the flag, which is next to the pole
    }


def pin(position: Vec3, role: str = GOAL) -> tuple[Marker, ...]:
    """Return the markers of a pin over a goal or a bin, with a disc around its foot."""
    x, y, z = position
    return (
        Marker("cylinder", (x, y, z + 0.005), (0.16, 0.004, 0.0), (*SKY[:3], 0.45), role),
        Marker("cylinder", (x, y, z + 0.36), (0.010, 0.12, 0.0), SKY, role),
        Marker("sphere", (x, y, z + 0.52), (0.05, 0.0, 0.0), SKY, role),
    )
