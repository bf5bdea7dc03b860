"""Object models made ready for a scene: visual geoms apart from those that collide, or removed."""

from typing import Any

import mujoco

VISUAL_BODY = "looks"  # body of an object's visual geoms


def remove_visuals(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """Remove what has no effect on motion, in place: geoms that meet nothing, materials, textures, unused meshes.

    Bodies stay, so that a state fits the models with and without visuals.
    """
    spec.compiler.discardvisual = True
    spec.compile()
    return spec


def separate_visuals(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """Give the visual geoms of an object a body of their own, fixed to the object's, in place.

    In every step the broad phase visits all geoms of every body that can collide, asleep or not. Geoms in nested
    frames stay where they are.
    """
    body = spec.body("object")
    groups: list[tuple[Any, list[Any]]] = []
    for geom in body.geoms:
        if not _is_visual(geom) or (geom.frame and geom.frame.frame):
            continue
        group = next((members for frame, members in groups if frame == geom.frame), None)
        if group is None:
            groups.append((geom.frame, group := []))
        group.append(geom)
    if body.bodies or not groups:
        return spec
    spec.copy_during_attach = True
    apart = body.add_body(name=VISUAL_BODY)
    apart.fuse = 0
    for frame, geoms in groups:
        _move(spec, geoms, _like(body, frame), apart)
    return spec


def _like(body: Any, frame: Any) -> Any:
    """A new frame of a body, placed as another one; None is none at all."""
    new = body.add_frame()
    if frame is not None:
        new.pos, new.quat = frame.pos, frame.quat
        for name in ("axisangle", "xyaxes", "zaxis", "euler", "type"):
            setattr(new.alt, name, getattr(frame.alt, name))
    return new


def _move(spec: mujoco.MjSpec, geoms: list[Any], frame: Any, body: Any) -> None:
    """Move geoms into a frame of their body, and that frame into another body."""
    names = [geom.name for geom in geoms]
    before = len(body.geoms)
    for geom in geoms:
        geom.name = ""  # while there are two of it
        geom.set_frame(frame)
    body.attach_frame(frame, "", "")
    spec.delete(frame)
    for geom, name in zip(body.geoms[before:], names, strict=True):
        geom.name = name


def _is_visual(geom: Any) -> bool:
    return not geom.contype and not geom.conaffinity and geom.mass == 0.0
