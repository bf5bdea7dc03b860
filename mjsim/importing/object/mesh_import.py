"""The whole way from a mesh file to an object in a house's catalogue."""

import json
from dataclasses import asdict
from pathlib import Path

from mjsim.formats.scene.options import ImportDecision, ImportOptions
from mjsim.house.validation.findings import Finding, errors
from mjsim.house.validation.object_rules import check_object
from mjsim.importing.object.grip import MAX_OFFSET
from mjsim.importing.object.house_extension import Entry, HouseExtension
from mjsim.importing.object.model_writer import write_model
from mjsim.importing.object.object_import import ImportedObject, import_object
from mjsim.importing.object.preview import write_preview
from mjsim.values.errors import AssetError, RenderError

PREVIEW, REPORT = "preview.png", "report.json"


def add_mesh(
    path: Path, extension: HouseExtension, entry: Entry, options: ImportOptions, *, force: bool = False
) -> tuple[ImportDecision, ...]:
    """Import a mesh file into a catalogue; returns the report, which is also kept beside the object.

    Without OpenGL there is no preview, and the report says so. The catalogue is as before on `AssetError` (the file,
    the entry or the object is unusable) and `OSError`; of an object that cannot be held there is a picture.
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
            shown = _keep_picture(folder, extension.folder / f"{entry.key}-{PREVIEW}")
            raise AssetError(f"{path}: this shape cannot be held: {reason}{shown}")
        text = json.dumps([asdict(decision) for decision in decisions], indent=2, ensure_ascii=False)
        (folder / REPORT).write_text(text + "\n", encoding="utf-8")

    extension.add(entry, write, force=force)
    return tuple(decisions)


def _not_held(item: ImportedObject, findings: list[Finding]) -> str:
    """Why an object cannot be held; empty where it can."""
    if found := errors(findings):
        return found[0].message
    if item.grip.offset <= MAX_OFFSET:
        return ""
    return (
        f"its top is {100 * item.grip.offset:.0f} cm beside its centre of mass, and a hand takes it there from above "
        f"(at most {100 * MAX_OFFSET:.0f} cm); turn or change it so that its top is nearer, or use --scale"
    )


def _keep_picture(folder: Path, target: Path) -> str:
    """Keep the preview in a folder under another name; says where, if there is one."""
    if not (folder / PREVIEW).exists():
        return ""
    (folder / PREVIEW).replace(target)
    return f" ({target} shows it)"
