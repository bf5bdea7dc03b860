"""Rules that check the model of a receptacle (docs/models.md, "A receptacle")."""

from collections.abc import Callable, Iterator
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.rays import first_hit
from mjsim.house.validation.checked_model import Compiled, compile_model
from mjsim.house.validation.findings import Finding, errors
from mjsim.house.validation.object_rules import check_structure

SIDE = (0.1, 1.2)  # minimum and maximum side length of a receptacle's interior, in metres
DEPTH = (0.08, 0.8)  # minimum and maximum height of a receptacle's interior, in metres
FLOOR = 0.03  # minimum thickness of a receptacle's floor, in metres
GAP = 0.02  # maximum gap between a receptacle's volume and its floor or walls, in metres
BASE_GAP = 0.005  # maximum distance of a receptacle's lowest point from z = 0, in metres
STIFF = 0.02  # maximum time constant of a receptacle's contacts, in seconds
_SLOTS = ((0.0, 0.0), (0.5, 0.5), (0.5, -0.5), (-0.5, 0.5), (-0.5, -0.5))
_SIDES = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
_DOWN = np.array([0.0, 0.0, -1.0])


def check_receptacle(path: Path, key: str | None = None) -> list[Finding]:
    """Check the MJCF file of a receptacle. `key` is the catalogue key, which defaults to the file name."""
    compiled = compile_model(f"receptacle {key or path.stem}", path)
    return check_compiled_receptacle(compiled) if isinstance(compiled, Compiled) else compiled


def check_compiled_receptacle(compiled: Compiled) -> list[Finding]:
    found = [*check_structure(compiled, "receptacle"), *_sites(compiled)]
    return found if errors(found) else [finding for rule in RULES for finding in rule(compiled)]


def _sites(compiled: Compiled) -> Iterator[Finding]:
    for name, use in (
        ("volume", 'type="box": its interior'),
        ("approach", "where a person stands to use it"),
    ):
        if compiled.site(name) is None:
            yield compiled.error("sites", f"has no site {name!r}", f'add <site name="{name}">, {use}')
    volume = compiled.site("volume")
    if volume is None:
        return
    if compiled.model.site_type[volume] != mujoco.mjtGeom.mjGEOM_BOX:
        yield compiled.error("sites", "the site 'volume' is not a box", 'give it type="box"')
        return
    if compiled.data.site_xmat[volume, 8] < 1 - 1e-6:
        yield compiled.error("sites", "the site 'volume' is tilted", "turn it about z only")
    width, depth, height = (2 * compiled.model.site_size[volume]).tolist()
    inside = SIDE[0] <= min(width, depth) and max(width, depth) <= SIDE[1] and DEPTH[0] <= height <= DEPTH[1]
    if not inside:
        yield compiled.error(
            "size",
            f"its volume is {width:.3g} x {depth:.3g} x {height:.3g} m",
            f"keep sides within {SIDE[0]} to {SIDE[1]} m and the height within {DEPTH[0]} to {DEPTH[1]} m",
        )


class _Volume:
    """The volume of a compiled receptacle in which objects count as delivered."""

    def __init__(self, compiled: Compiled) -> None:
        site = compiled.site("volume")
        self.centre = compiled.data.site_xpos[site]
        self.half = compiled.model.site_size[site]
        self.axes = compiled.data.site_xmat[site].reshape(3, 3)
        self.bottom = float(self.centre[2] - self.half[2])
        self.top = float(self.centre[2] + self.half[2])

    def at(self, x: float, y: float, height: float) -> NDArray[np.float64]:
        point = self.centre + self.axes @ (self.half * [x, y, 0.0])
        return np.array([point[0], point[1], height])


def _open_top(compiled: Compiled) -> Iterator[Finding]:
    volume = _Volume(compiled)
    for x, y in _SLOTS:
        start = volume.at(x, y, volume.top + 0.5)
        distance, geom = first_hit(compiled.model, compiled.data, start, _DOWN)
        height = start[2] - distance
        if geom < 0 or height < volume.bottom - GAP:
            yield compiled.error(
                "container",
                "has no floor below the volume",
                f"add a colliding floor whose top is at z = {volume.bottom:.3f} m",
                start,
            )
            return
        if height > volume.bottom + GAP:
            yield compiled.error(
                "container",
                f"{compiled.geom_name(geom)} closes it or fills it up to z = {height:.3f} m",
                f"leave it open above its floor at z = {volume.bottom:.3f} m, or raise the volume",
                (*start[:2], height),
            )
            return
        thick = float(2 * compiled.model.geom_aabb[geom, 3:].min())
        if (x, y) == (0.0, 0.0) and thick < FLOOR:
            yield compiled.warning(
                "container", f"its floor is {1000 * thick:.0f} mm thick", "make it 40 mm: things fall on it"
            )


def _walls(compiled: Compiled) -> Iterator[Finding]:
    volume = _Volume(compiled)
    for x, y in _SIDES:
        start, out = volume.at(0, 0, volume.bottom + 0.01), volume.axes @ np.array([x, y, 0.0])
        room = float(volume.half[0] if x else volume.half[1])
        distance, geom = first_hit(compiled.model, compiled.data, start, out)
        if geom < 0 or distance > room + GAP:
            yield compiled.error(
                "container",
                f"has no wall {room:.2f} m from its middle towards ({out[0]:.1f}, {out[1]:.1f})",
                "add a colliding wall there, or enlarge the volume up to it",
                start + room * out,
            )
        elif distance < room - GAP:
            yield compiled.error(
                "container",
                f"{compiled.geom_name(geom)} stands {room - distance:.2f} m within the volume",
                "shrink the volume to the interior",
                start + distance * out,
            )


def _base(compiled: Compiled) -> Iterator[Finding]:
    low, high = compiled.extent(compiled.solid)
    if abs(low[2]) > BASE_GAP:
        yield compiled.error(
            "rest", f"its lowest point is at z = {low[2]:.3f} m", "put the origin at the centre of its base"
        )
    approach = compiled.data.site_xpos[compiled.site("approach")]
    if np.all(approach[:2] > low[:2]) and np.all(approach[:2] < high[:2]):
        yield compiled.error(
            "approach",
            f"the site 'approach' at {approach[:2].round(2).tolist()} m lies inside of it",
            f'move it in front, to about pos="0 {low[1] - 0.4:.2f} 0"',
            approach,
        )
    elif approach[1] > low[1]:
        yield compiled.warning(
            "approach",
            "the site 'approach' is not in front of it, at local -y",
            f'move it to about pos="0 {low[1] - 0.4:.2f} 0"',
            approach,
        )


def _contacts(compiled: Compiled) -> Iterator[Finding]:
    model = compiled.model
    for geom in compiled.solid:
        name, soft = compiled.geom_name(int(geom)), float(model.geom_solref[geom, 0])
        if model.geom_condim[geom] < 6 or soft > STIFF:
            yield compiled.warning(
                "container",
                f"geom {name} has condim {model.geom_condim[geom]} and solref {soft:g}",
                'give it condim="6" solref="0.008 1", or things roll on and sink in',
                compiled.data.geom_xpos[geom],
            )


RULES: tuple[Callable[[Compiled], Iterator[Finding]], ...] = (_open_top, _walls, _base, _contacts)
