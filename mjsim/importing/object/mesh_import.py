"""Import a mesh file into a catalogue as an object, and draw a preview of the object."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.formats.scene.source_scene import ImportDecision, ImportOptions
from mjsim.house.catalogue.model_files import read_model
from mjsim.house.validation.findings import Finding, errors
from mjsim.house.validation.object_rules import check_object
from mjsim.importing.object.grip import MAX_OFFSET
from mjsim.importing.object.house_extension import CatalogueEntry, HouseExtension
from mjsim.importing.object.model_writer import write_model, write_png
from mjsim.importing.object.object_import import ImportedObject, import_object
from mjsim.render.pictures import draw_picture
from mjsim.values.errors import AssetError, RenderError

_PREVIEW_SIDE = 420  # width and height of each picture in a preview, in pixels
_COLOURS = (
    (0.90, 0.45, 0.13), (0.20, 0.55, 0.80), (0.30, 0.65, 0.30), (0.80, 0.30, 0.45), (0.55, 0.40, 0.75),
    (0.75, 0.65, 0.15), (0.45, 0.45, 0.45),
)  # fmt: skip
_GRIPS = {"grip_0": (0.85, 0.1, 0.1, 1.0), "grip_1": (0.1, 0.2, 0.85, 1.0)}
_ARROW = 0.03  # length of the arrow that shows a grip, in metres
_LOOK, _PART = 2, 3  # geom groups of visual meshes and of collision parts
PREVIEW, REPORT = "preview.png", "report.json"


def write_preview(model: Path, out: Path) -> None:
    """Draw the visual mesh and the collision parts of an object side by side, with arrows at its grips."""
    pictures = []
    for shown in (_LOOK, _PART):
        spec = read_model(model, body="object")
        _prepare(spec, shown)
        try:
            compiled = spec.compile()
        except ValueError as error:
            raise AssetError(f"cannot compile {model}: {error}") from error
        pictures.append(_on_white(draw_picture(compiled, _PREVIEW_SIDE, str(model))))
    write_png(out, np.concatenate(pictures, axis=1))


def _prepare(spec: mujoco.MjSpec, shown: int) -> None:
    body = spec.body("object")
    parts = [geom for geom in body.geoms if geom.contype]
    for geom in body.geoms:
        geom.group = _LOOK if (geom.contype != 0) == (shown == _PART) else _PART
    for number, geom in enumerate(parts):
        geom.rgba = [*_COLOURS[number % len(_COLOURS)], 1.0]
    for name, colour in _GRIPS.items():
        _add_arrow(body, spec.site(name), colour)


def _add_arrow(body: Any, site: Any, colour: tuple[float, ...]) -> None:
    yaw = site.alt.euler[2]
    start = site.pos + np.array([0.0, 0.0, 0.004])
    tip = start + _ARROW * np.array([np.cos(yaw), np.sin(yaw), 0.0])
    look = {"rgba": colour, "group": _LOOK, "contype": 0, "conaffinity": 0}
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=[0.0025, 0.0, 0.0], fromto=[*start, *tip], **look)
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.005, 0.0, 0.0], pos=tip, **look)


def _on_white(rgba: NDArray[np.uint8]) -> NDArray[np.uint8]:
    alpha = rgba[..., 3:].astype(np.float64) / 255
    return np.asarray(np.round(rgba[..., :3] * alpha + 255 * (1 - alpha)), dtype=np.uint8)


def add_mesh(
    path: Path,
    extension: HouseExtension,
    entry: CatalogueEntry,
    options: ImportOptions,
    *,
    force: bool = False,
) -> tuple[ImportDecision, ...]:
    """Import a mesh file into a catalogue. Return the import report, which is also stored with the object.

    Without OpenGL, there is no preview. Raise an AssetError, and leave the catalogue unchanged, if the file,
    the entry or the object cannot be used. If a hand cannot hold the object, its preview is kept.
    """
    extension.check(entry, force=force)
    item = import_object(path, options)
    decisions = [*item.decisions, extension.fit(entry, item.size)]

    def write(folder: Path) -> None:
        model = write_model(item, folder, key=entry.key, label=entry.label, source=path.name)
        try:
            write_preview(model, folder / PREVIEW)
        except RenderError as error:
            decisions.append(ImportDecision("preview", "none", str(error)))
        if reason := _not_held(item, check_object(model, entry.key)):
            shown = ""
            if (folder / PREVIEW).exists():
                kept = (folder / PREVIEW).replace(extension.folder / f"{entry.key}-{PREVIEW}")
                shown = f" ({kept} shows it)"
            raise AssetError(f"{path}: this shape cannot be held: {reason}{shown}")
        text = json.dumps([asdict(decision) for decision in decisions], indent=2, ensure_ascii=False)
        (folder / REPORT).write_text(text + "\n", encoding="utf-8")

    extension.add(entry, write, force=force)
    return tuple(decisions)


def _not_held(item: ImportedObject, findings: list[Finding]) -> str:
    """Return the reason why a hand cannot hold an object, or an empty string if it can."""
    if found := errors(findings):
        return found[0].message
    if item.grip.offset <= MAX_OFFSET:
        return ""
    return (
        f"its top is {100 * item.grip.offset:.0f} cm beside its centre of mass, and a hand takes it there from above "
        f"(at most {100 * MAX_OFFSET:.0f} cm); turn or change it so that its top is nearer, or use --scale"
    )
