"""A picture of an imported object: as it looks, and the convex parts that it collides with, with its grips."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.catalogue.model_files import read_model
from mjsim.importing.object.model_writer import write_png
from mjsim.render.pictures import draw_picture
from mjsim.values.errors import AssetError

SIDE = 420  # px
_COLOURS = (
    (0.90, 0.45, 0.13), (0.20, 0.55, 0.80), (0.30, 0.65, 0.30), (0.80, 0.30, 0.45), (0.55, 0.40, 0.75),
    (0.75, 0.65, 0.15), (0.45, 0.45, 0.45),
)  # fmt: skip
_GRIPS = {"grip_0": (0.85, 0.1, 0.1, 1.0), "grip_1": (0.1, 0.2, 0.85, 1.0)}
_ARROW = 0.03  # m
_LOOK, _PART = 2, 3  # geom groups of docs/models.md


def write_preview(model: Path, out: Path) -> None:
    """Draw an object's MJCF file, look and parts side by side; the arrows are the grips' x axes, ahead of the hand."""
    pictures = []
    for shown in (_LOOK, _PART):
        spec = read_model(model, body="object")
        _prepare(spec, shown)
        try:
            compiled = spec.compile()
        except ValueError as error:
            raise AssetError(f"cannot compile {model}: {error}") from error
        pictures.append(_on_white(draw_picture(compiled, SIDE, str(model))))
    write_png(out, np.concatenate(pictures, axis=1))


def _prepare(spec: mujoco.MjSpec, shown: int) -> None:
    """Show only the look or only the parts, in colours of their own, and the grips."""
    body = spec.body("object")
    parts = [geom for geom in body.geoms if geom.contype]
    for geom in body.geoms:
        geom.group = _LOOK if (geom.contype != 0) == (shown == _PART) else _PART
    for number, geom in enumerate(parts):
        geom.rgba = [*_COLOURS[number % len(_COLOURS)], 1.0]
    for name, colour in _GRIPS.items():
        _add_arrow(body, spec.site(name), colour)


def _add_arrow(body: Any, site: Any, colour: tuple[float, ...]) -> None:
    """A rod from a site along its x axis."""
    turn = np.zeros(4)
    if site.alt.type == mujoco.mjtOrientation.mjORIENTATION_EULER:
        turn[:] = np.cos(site.alt.euler[2] / 2), 0.0, 0.0, np.sin(site.alt.euler[2] / 2)
    else:
        turn[:] = site.quat
    tip = np.zeros(3)
    mujoco.mju_rotVecQuat(tip, np.array([_ARROW, 0.0, 0.0]), turn)
    start = np.array([*site.pos[:2], site.pos[2] + 0.004])
    for kind, size, ends in (
        (mujoco.mjtGeom.mjGEOM_CAPSULE, [0.0025, 0.0, 0.0], (*start, *(start + tip))),
        (mujoco.mjtGeom.mjGEOM_SPHERE, [0.005, 0.0, 0.0], None),
    ):
        geom = body.add_geom(type=kind, size=size, rgba=colour, group=_LOOK, contype=0, conaffinity=0)
        if ends is None:
            geom.pos = start + tip
        else:
            geom.fromto = ends


def _on_white(rgba: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """A picture (h, w, 4) as RGB (h, w, 3) on white."""
    alpha = rgba[..., 3:].astype(np.float64) / 255
    return np.asarray(np.round(rgba[..., :3] * alpha + 255 * (1 - alpha)), dtype=np.uint8)
