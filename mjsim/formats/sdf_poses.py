"""Read poses from SDF files. The <state> of a world replaces the poses of its models, as in Gazebo Classic."""

import xml.etree.ElementTree as ET
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from trimesh.transformations import compose_matrix

from mjsim.formats.scene.source_scene import numbers
from mjsim.formats.scene.surface import Floats
from mjsim.values.errors import AssetError

DEPTH = 20  # maximum nesting depth of models, and maximum length of a chain of `relative_to` references
_ROUND = ("sphere", "cylinder", "capsule")  # shapes that keep a circular cross-section when they are scaled


def pose_of(element: ET.Element, path: Path, model: ET.Element | None = None, depth: int = 0) -> Floats:
    """Return the transform (4, 4) that the <pose> of an element specifies.

    Args:
        element: A model, link, joint or other element, whose pose consists of x, y, z, roll, pitch and yaw.
        path: The file that error messages mention.
        model: The element that contains the target of `relative_to`.
        depth: Number of `relative_to` references that have been followed so far.
    """
    pose = element.find("pose")
    attributes = {} if pose is None else pose.attrib
    named = attributes.get("relative_to") or element.get("attached_to") or ""
    if element.tag == "joint":
        named = named or element.findtext("child") or ""
    frame = np.eye(4)
    if named not in ("", "world", "__model__"):
        other = next((e for e in (() if model is None else model) if e.get("name") == named), None)
        if other is None or depth > DEPTH:
            raise AssetError(f"{path} has a <pose> relative to {named!r}, which is not there; correct it")
        frame = pose_of(other, path, model, depth + 1)
    if pose is None or not (pose.text or "").strip():
        return frame
    if attributes.get("rotation_format", "euler_rpy") != "euler_rpy":
        raise AssetError(f"{path} has a <pose> with {dict(attributes)}; write it as 'x y z roll pitch yaw'")
    values = numbers((pose.text or "").split(), 6, path)
    if is_true(pose.get("degrees")):
        values[3:] = np.deg2rad(values[3:])
    return np.asarray(frame @ compose_matrix(translate=values[:3], angles=values[3:]))


def is_true(text: str | None) -> bool:
    return (text or "").strip().lower() in ("1", "true")


@dataclass(frozen=True, eq=False)
class SavedState:
    """The <state> of a world, or the part of it that is about one model. Its poses are relative to the world."""

    path: Path  # file to name in error messages
    element: ET.Element | None = None  # a <state>, a <model> in it, or None if nothing was saved
    prefix: str = ""  # prefix of link names, if the links of a nested model are listed under the outer model

    @cached_property
    def deleted(self) -> frozenset[str]:
        """The names of models that were deleted before the world was saved."""
        found = () if self.element is None else self.element.findall("deletions/name")
        return frozenset((name.text or "").strip() for name in found)

    @cached_property
    def _models(self) -> dict[str, ET.Element]:
        return self._named("model")

    @cached_property
    def _links(self) -> dict[str, ET.Element]:
        return self._named("link")

    def _named(self, tag: str) -> dict[str, ET.Element]:
        found = [] if self.element is None else self.element.findall(tag)
        return {element.get("name", ""): element for element in reversed(found)}

    def of(self, name: str) -> "SavedState":
        """Return the state of a model in this world or model."""
        if (found := self._models.get(name)) is not None:
            return SavedState(self.path, found)
        if self.element is None or self.element.tag == "state":
            return SavedState(self.path)
        return replace(self, prefix=f"{self.prefix}{name}::")

    def model_frame(self, own: Floats) -> Floats:
        """Return the transform from the model to the world. `own` is the transform without a state."""
        return own if self.prefix else self._frame(self.element, own)

    def link_frame(self, name: str, own: Floats) -> Floats:
        """Return the transform from a link to the world. `own` is the transform without a state."""
        return self._frame(self._links.get(self.prefix + name), own)

    def _frame(self, element: ET.Element | None, own: Floats) -> Floats:
        return own if element is None or element.find("pose") is None else pose_of(element, self.path)

    def shape_scale(self, kind: str, own: Floats) -> Floats:
        """Return the scale (3,) of a shape. `own` is the scale in the shape's own element.

        Gazebo multiplies the sizes of primitive shapes by the saved scale, but sets the scale of meshes to it.
        """
        text = None if self.element is None or self.prefix else self.element.findtext("scale")
        scale = np.ones(3) if text is None else numbers(text.split(), 3, self.path)
        if kind == "mesh":
            return own if np.allclose(scale, 1.0) else scale
        if kind in _ROUND:
            across = scale.max() if kind == "sphere" else scale[:2].max()
            scale = np.array([across, across, across if kind == "sphere" else scale[2]])
        return np.asarray(own * scale)
