"""Create self-contained HTML pages that show recorded runs."""

import base64
import gzip
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import msgspec

from experiments.house import House, read_words
from experiments.record.reader import Record
from experiments.trials.design import counted
from experiments.trials.replay.replay import replay
from experiments.trials.replay.replayer import Replayer
from experiments.web.client_files import MEDIA_TYPES, STATIC, modules_of, rendered, trial_texts
from experiments.web.viewing import timeline
from experiments.web.viewing.recorder import RunRecorder
from experiments.web.worker.encoders import data_url
from mjsim.formats.gltf.cache import cached_scene
from mjsim.formats.gltf.store import GZIP, scenes_folder
from mjsim.house.scene.avatar import EYE_FORWARD
from mjsim.render import render_pictures


def view_page(
    directory: Path,
    *,
    catalogue: str | None = None,
    on_progress: Callable[[int, int], None] = lambda *_: None,
) -> str:
    """Replay a run and return an HTML page that shows it.

    Args:
        directory: Directory of a complete or failed run.
        catalogue: Current path of the house's catalogue if it was moved after the run.
        on_progress: Called repeatedly with the number of replayed control steps and their total number.

    Raises:
        RecordError: `directory` is not a run directory.
        ReplayError: The run cannot be replayed, or the replay differs from the record.
    """
    watched: list[Replayer] = []
    seen = RunRecorder()

    def watch(replayer: Replayer) -> RunRecorder:
        watched.append(replayer)
        return seen

    replay(directory, watch=watch, catalogue=catalogue, on_progress=on_progress)
    (replayer,) = watched
    record, house = replayer.record, replayer.house
    models = {placed.model for placed in record.episode.objects}
    return run_page(_title(record), _run(record, house, seen), _scene(house, models))


def run_page(title: str, run: Mapping[str, Any], scene: Mapping[str, bytes], **values: Any) -> str:
    """Return an HTML page that shows a run. `scene` has the scene's files. `values` go to the template."""
    urls = {name: _data_url(name, content) for name, content in scene.items()}
    texts = trial_texts(read_words())
    packed = {"run": _packed(run), "scene": _packed(urls)}
    return own_page("view", "view/view.js", title=title, texts=texts, **packed, **values)


def own_page(template: str, entry: str, **values: Any) -> str:
    """Return a self-contained HTML page that runs the client's module `entry`."""
    modules = {name: _data_url(name, source.encode()) for name, source in modules_of(entry).items()}
    style = (STATIC / "style.css").read_text("utf-8")
    imports = msgspec.json.encode({"imports": modules}).decode()
    return rendered(template, style=style, modules=imports, entry=entry, **values)


def _run(record: Record, house: House, seen: RunRecorder) -> dict[str, Any]:
    """Return the data of the page in the `Run` format of view/run.js."""
    person = record.person
    return {
        "person": {
            "eye_height": person.eye_height,
            "eye_forward": EYE_FORWARD,
            "body_radius": person.body_radius,
            "field_of_view": person.field_of_view,
        },
        "bounds": house.bounds,
        "models": {placed.name: placed.model for placed in record.episode.objects},
        "time": seen.time,
        "body": seen.body,
        "hands": seen.hands,
        "objects": seen.objects,
        "hud": seen.hud,
        "markers": seen.markers,
        "shown": seen.shown,
        "moments": timeline.moments(record, house),
        "plans": timeline.plans(record, house),
        "pictures": {key: data_url(picture) for key, picture in render_pictures(house.catalogue).items()},
    }


def _scene(house: House, models: set[str]) -> dict[str, bytes]:
    folder = cached_scene(house.catalogue, scenes_folder())
    found = {}
    for path in sorted(folder.rglob("*.*")):
        name = path.relative_to(folder).as_posix().removesuffix(GZIP)
        if Path(name).stem in models or not name.startswith(("objects/", "floor", "view")):
            content = path.read_bytes()
            found[name] = gzip.decompress(content) if path.suffix == GZIP else content
    return found


def _title(record: Record) -> str:
    start = record.start
    return f"{start['user']}, {start['assistance']}, {counted(len(record.names), 'object')}, seed {start['house_seed']}"


def _packed(value: Any) -> str:
    return base64.b64encode(gzip.compress(msgspec.json.encode(value), 9, mtime=0)).decode()


def _data_url(name: str, data: bytes) -> str:
    return f"data:{MEDIA_TYPES[Path(name).suffix]};base64,{base64.b64encode(data).decode()}"
