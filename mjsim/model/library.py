"""Models as they are read from files, kept for as long as their catalogue: a new episode reads nothing anew."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import mujoco

from mjsim.errors import AssetError

LOOKS = "looks"  # body of an object's geoms that only look

T = TypeVar("T")


class Library:
    """What was read or worked out for one catalogue; a file that changes later is not read again."""

    def __init__(self) -> None:
        self._kept: dict[Any, Any] = {}

    def once(self, key: Any, make: Callable[[], T]) -> T:
        """What `make` gives at the first call with `key`, and the same thing ever after."""
        if key not in self._kept:
            self._kept[key] = make()
        return cast(T, self._kept[key])

    def object_model(self, path: Path) -> mujoco.MjSpec:
        """An object model, for attaching; not to be changed.

        Raises:
            AssetError: The file is malformed or has no top-level body `object`.
        """
        return self.once(("object", path), lambda: _set_looks_apart(read_model(path, body="object")))

    def __reduce__(self) -> tuple[type["Library"], tuple[()]]:
        """Another process reads for itself; a copy is as good as new."""
        return (Library, ())


def read_model(path: Path, *, body: str | None = None) -> mujoco.MjSpec:
    """Read a model, with its asset files named absolutely, since attaching mixes folders.

    Args:
        path: MJCF file.
        body: Top-level body that it has to have.

    Raises:
        AssetError: The file is malformed or lacks the body.
    """
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise AssetError(f"cannot read model {path}: {error}") from error
    if body is not None and (spec.body(body) is None or spec.body(body).parent != spec.worldbody):
        raise AssetError(f"model {path} has no top-level body {body!r}")
    for mesh in spec.meshes:
        mesh.file = _absolute(path.parent, spec.compiler.meshdir, mesh.file)
    for texture in spec.textures:
        texture.file = _absolute(path.parent, spec.compiler.texturedir, texture.file)
        for face, file in enumerate(texture.cubefiles):
            texture.cubefiles[face] = _absolute(path.parent, spec.compiler.texturedir, file)
    return spec


def _absolute(folder: Path, subfolder: str, file: str) -> str:
    return str((folder / subfolder / file).resolve()) if file else file


def _set_looks_apart(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """Give the geoms of an object that only look a body of their own, fixed to it.

    In every step the broad phase visits all geoms of every body that can collide, asleep or not. What lies in frames
    within frames stays where it is.
    """
    body = spec.body("object")
    groups: list[tuple[Any, list[Any]]] = []
    for geom in body.geoms:
        if geom.contype or geom.conaffinity or geom.mass != 0.0 or (geom.frame and geom.frame.frame):
            continue
        group = next((members for frame, members in groups if frame == geom.frame), None)
        if group is None:
            groups.append((geom.frame, group := []))
        group.append(geom)
    if body.bodies or not groups:
        return spec
    spec.copy_during_attach = True
    apart = body.add_body(name=LOOKS)
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
