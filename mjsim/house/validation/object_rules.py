"""Rules that check the models of objects that a person can carry (docs/models.md, "An object")."""

from collections.abc import Callable, Iterator
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.validation.checked_model import (
    Compiled,
    check_contact_bits,
    check_groups,
    check_still,
    compile_model,
)
from mjsim.house.validation.findings import Finding, errors

SIZE = (0.06, 0.32)  # minimum and maximum length of an object's longest side, in metres
MASS = (0.03, 1.5)  # minimum and maximum mass of an object, in kilograms
REST_GAP = 0.002  # maximum distance of an object's lowest point from z = 0, in metres
OFF_CENTRE = 0.03  # maximum distance from an object's origin to the centre of its footprint, in metres
GRIP_GAP = 0.03  # maximum height difference between a grip site and the top of the object, in metres
GRIP_REACH = 0.05  # maximum distance from a grip site to the nearest colliding part, in metres
UPRIGHT = 0.99  # minimum cosine of the angle between the z axis of a grip site and the vertical
TURN = 0.1  # tolerance for the cosine of the angle between the x axes of both grips, which should be -1
THIN = 0.015  # minimum thickness of the colliding parts of an object, in metres
LOOK_GAP = 0.03  # maximum distance between the bounding boxes of visible and colliding geoms, in metres
SLENDER = 1e-4  # minimum moment of inertia, relative to mass times squared radius
ROUND = [
    int(getattr(mujoco.mjtGeom, f"mjGEOM_{name}")) for name in ("SPHERE", "CAPSULE", "CYLINDER", "ELLIPSOID")
]
GRIPS = ("grip_0", "grip_1")


def check_object(path: Path, key: str | None = None) -> list[Finding]:
    """Check the MJCF file of an object. `key` is the catalogue key, which defaults to the file name."""
    subject = f"object {key or path.stem}"
    compiled = compile_model(subject, path)
    return check_compiled_object(compiled) if isinstance(compiled, Compiled) else compiled


def check_compiled_object(compiled: Compiled) -> list[Finding]:
    found = list(check_structure(compiled, "object"))
    return found if errors(found) else [finding for rule in RULES for finding in rule(compiled)]


def check_structure(compiled: Compiled, body: str) -> Iterator[Finding]:
    """Check that a model has a single body, called `body`, with colliding and visible geoms."""
    model = compiled.model
    names = [model.body(b).name for b in range(1, model.nbody)]
    if names != [body]:
        yield compiled.error(
            "body", f"has the bodies {names}", f"keep one body, on top level and named {body!r}"
        )
    outside = np.flatnonzero(model.geom_bodyid == 0)
    if len(outside):
        name = compiled.geom_name(int(outside[0]))
        yield compiled.error("body", f"geom {name} is outside all bodies", f"move it into body {body!r}")
    if not len(compiled.solid):
        yield compiled.error(
            "contact", "no geom collides, so it falls through the floor", "add convex parts in group 3"
        )
    if not len(compiled.shown):
        yield compiled.error(
            "groups", "no geom is seen", "add geoms in group 2 that are not transparent, or use group 0"
        )
    for rule in (check_still, check_groups, check_contact_bits):
        yield from rule(compiled)


def _size(compiled: Compiled) -> Iterator[Finding]:
    low, high = compiled.extent(compiled.solid)
    side = float((high - low).max())
    if not SIZE[0] <= side <= SIZE[1] + 1e-3:
        factor = 1e-3 if side > 20 else 0.01 if side > 2 else None
        unit = f" (units: scale the meshes by {factor:g}?)" if factor else ""
        yield compiled.error(
            "size",
            f"its longest side is {side:.3g} m",
            f"scale it to {SIZE[0]} to {SIZE[1]} m, what a hand carries{unit}",
        )


def _rest(compiled: Compiled) -> Iterator[Finding]:
    low, high = compiled.extent(compiled.solid)
    if abs(low[2]) > REST_GAP:
        yield compiled.error(
            "rest",
            f"its lowest point is at z = {low[2]:.3f} m",
            f"move the geoms by {-low[2]:.3f} m: it stands on z = 0",
            (*(low + high)[:2] / 2, low[2]),
        )
    middle = (low + high)[:2] / 2
    if np.abs(middle).max() > OFF_CENTRE:
        yield compiled.error(
            "rest",
            f"its origin lies {np.hypot(*middle):.2f} m from the middle of its footprint",
            f"move the geoms by ({-middle[0]:.3f}, {-middle[1]:.3f}) m",
            (*middle, low[2]),
        )


def _mass(compiled: Compiled) -> Iterator[Finding]:
    model = compiled.model
    mass = float(model.body_mass[1])
    if not MASS[0] <= mass <= MASS[1]:
        yield compiled.error(
            "mass", f"weighs {mass:.4g} kg", f"give its parts masses of {MASS[0]} to {MASS[1]} kg together"
        )
        return
    low, high = compiled.extent(compiled.solid)
    centre = compiled.data.xipos[1]
    if np.any(centre < low - 1e-3) or np.any(centre > high + 1e-3):
        yield compiled.error(
            "inertia",
            f"its centre of mass {centre.round(3).tolist()} lies outside of it",
            "remove <inertial>, or place it inside",
            centre,
        )
        return
    reach = float(np.linalg.norm(np.maximum(high - centre, centre - low)))
    least, greatest = mass * reach**2 * SLENDER, mass * reach**2
    inertia = model.body_inertia[1]
    if inertia.min() < least or inertia.max() > greatest * 1.01:
        yield compiled.error(
            "inertia",
            f"moments of inertia {inertia.tolist()} kg m^2 do not fit {mass:.3g} kg within {reach:.2f} m",
            f"remove <inertial>, or give values of {least:.1e} to {greatest:.1e}",
            centre,
        )


def _grips(compiled: Compiled) -> Iterator[Finding]:
    sites = [compiled.site(name) for name in GRIPS]
    for name, site in zip(GRIPS, sites, strict=True):
        if site is None:
            yield compiled.error("grips", f"has no site {name!r}", f"add <site name={name!r}> at its top")
    frames = [compiled.data.site_xmat[s].reshape(3, 3) for s in sites if s is not None]
    for name, site in zip(GRIPS, sites, strict=True):
        if site is not None:
            yield from _grip(compiled, name, compiled.data.site_xpos[site])
    for name, frame in zip(GRIPS, frames, strict=False):
        if frame[2, 2] < UPRIGHT:
            yield compiled.error("grips", f"the z axis of {name} does not point up", "turn about z only")
    if len(frames) == 2 and frames[0][:, 0] @ frames[1][:, 0] > TURN - 1:
        yield compiled.error(
            "grips",
            "grip_0 and grip_1 are not turned by 180 degrees",
            'give grip_1 euler="0 0 180" in degrees, or quat="0 0 0 1"',
        )


def _grip(compiled: Compiled, name: str, at: NDArray[np.float64]) -> Iterator[Finding]:
    low, high = compiled.extent(compiled.solid)
    beside = np.maximum(np.maximum(low - at, at - high), 0.0)[:2]
    top = float(high[2])
    if np.hypot(*beside) > 1e-3 or abs(at[2] - top) > GRIP_GAP:
        yield compiled.error(
            "grips",
            f"{name} at {at.round(3).tolist()} m is not at the top of the object, z = {top:.3f} m",
            f'move it to pos="0 0 {top:.3f}"',
            at,
        )
        return
    gap = min(_distance(compiled, int(geom), at) for geom in compiled.solid)
    if gap > GRIP_REACH:
        yield compiled.error(
            "grips",
            f"{name} at {at.round(3).tolist()} m is {gap:.2g} m from the nearest part that collides",
            "move it onto a part that reaches the top",
            at,
        )


def _distance(compiled: Compiled, geom: int, at: NDArray[np.float64]) -> float:
    box = compiled.model.geom_aabb[geom]
    local = compiled.data.geom_xmat[geom].reshape(3, 3).T @ (at - compiled.data.geom_xpos[geom])
    return float(np.linalg.norm(np.maximum(np.abs(local - box[:3]) - box[3:], 0.0)))


def _parts(compiled: Compiled) -> Iterator[Finding]:
    model = compiled.model
    for geom in compiled.solid:
        thin = float(2 * model.geom_aabb[geom, 3:].min())
        if thin < THIN - 5e-5:  # A part passes if its thickness is printed as 15.0 mm.
            yield compiled.warning(
                "thin",
                f"geom {compiled.geom_name(int(geom))} is {1000 * thin:.1f} mm thin",
                f"make colliding parts at least {1000 * THIN:g} mm thick: thinner ones slip through others",
                compiled.data.geom_xpos[geom],
            )
        if model.geom_type[geom] in ROUND and model.geom_condim[geom] < 4:
            yield compiled.warning(
                "rolling",
                f"the round geom {compiled.geom_name(int(geom))} has condim {model.geom_condim[geom]}",
                'give it condim="6" friction="1 0.02 0.002", or it does not stop rolling',
                compiled.data.geom_xpos[geom],
            )


def _looks(compiled: Compiled) -> Iterator[Finding]:
    gap = np.abs(compiled.extent(compiled.shown) - compiled.extent(compiled.solid))
    if gap.max() > LOOK_GAP:
        yield compiled.warning(
            "looks",
            f"what is seen ends up to {gap.max():.3f} m from what collides",
            "fit the colliding parts to the look: hands would grip the air",
        )


RULES: tuple[Callable[[Compiled], Iterator[Finding]], ...] = (_size, _rest, _mass, _grips, _parts, _looks)
