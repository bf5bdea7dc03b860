"""The whole way from a mesh file to an object in a house's catalogue."""

import json
from dataclasses import asdict
from pathlib import Path

from mjsim.errors import RenderError
from mjsim.importing.house_extension import Entry, HouseExtension
from mjsim.importing.model_writer import write_model
from mjsim.importing.object_import import import_object
from mjsim.importing.preview import write_preview
from mjsim.importing.values import ImportDecision, ImportOptions

PREVIEW, REPORT = "preview.png", "report.json"


def add_mesh(
    path: Path, extension: HouseExtension, entry: Entry, options: ImportOptions, *, force: bool = False
) -> tuple[ImportDecision, ...]:
    """Import a mesh file into a catalogue; returns the report, which is also kept beside the object.

    Without OpenGL there is no preview, and the report says so. The catalogue is as before on `AssetError` (the file,
    the entry or the object is unusable) and `OSError`.
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
        text = json.dumps([asdict(decision) for decision in decisions], indent=2, ensure_ascii=False)
        (folder / REPORT).write_text(text + "\n", encoding="utf-8")

    extension.add(entry, write, force=force)
    return tuple(decisions)
