"""Read and write tables of trials, and describe their columns."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from experiments.errors import RecordError
from experiments.record.columns import HEALTH
from experiments.record.metrics import COUNTED, Displays, Metrics
from experiments.record.phases import is_simulated
from experiments.trials.attributes import Columns, described
from experiments.trials.trial_config import SEEDS, TrialConfig
from mjsim.support.files import check_input, replacing
from mjsim.values.motion_parameters import GROUPS
from mjsim.values.person_parameters import PersonParameters

NAME = "trials"
_TRIAL = ("user", *SEEDS, "assistance", "objects", "fingerprint")  # columns that identify a trial
# Metadata key of the column types. They are stored twice because a Parquet footer has no checksum.
_WRITTEN = b"mjsim.columns"
_QUANTITIES = {
    "penetration_m": "penetration depth of objects or the body",
    "trunk_penetration_m": "penetration depth of the trunk and the house",
    "weld_error_m": "distance of a carried object from its place in the hand",
    "weld_error_rad": "angle of a carried object from its orientation in the hand",
    "settle_s": "time until a released object comes to rest",
}
_STATISTICS = {"max": "Largest", "p99": "99th percentile of the", "mean": "Mean"}
_CIRCUMSTANCES = {
    "frames_sha256": ("str | null", "SHA-256 of the pixels of all frames; null without a film."),
    "renderer": ("str", "Renderer of the frames."),
    "wall_s": ("float", "Wall time of the trial, s."),
}


def write_tables(folder: Path, rows: Sequence[Mapping[str, Any]]) -> tuple[Path, Path]:
    """Atomically write `trials.parquet` and `trials.csv`, and return their paths.

    The columns are all keys of the rows, in order of first appearance.
    """
    columns = list(dict.fromkeys(key for row in rows for key in row))
    table = pa.table({c: [row.get(c) for row in rows] for c in columns})
    parquet, csv = folder / f"{NAME}.parquet", folder / f"{NAME}.csv"
    written = table.replace_schema_metadata({_WRITTEN: json.dumps(_types(table.schema))})
    # Pass open files to pyarrow, because it rejects paths that are not UTF-8 or that look like URLs.
    with replacing(parquet) as temporary, temporary.open("wb") as file:
        pa.parquet.write_table(written, file, write_page_checksum=True)
    # Columns without values have no type, so the CSV file omits them.
    present = [c for c in columns if table[c].null_count < len(rows)]
    with replacing(csv) as temporary, temporary.open("wb") as file:
        pa.csv.write_csv(table.select(present), file)
    return parquet, csv


def read_rows(path: Path) -> list[dict[str, Any]]:
    """Read the rows of a Parquet file, in which each trial must occur only once."""
    try:
        check_input(path)
        with path.open("rb") as file:
            table = pa.parquet.read_table(file, page_checksum_verification=True)
        _check_columns(table.schema)
        rows: list[dict[str, Any]] = table.to_pylist()
    except (OSError, ValueError, pa.ArrowException) as error:
        raise RecordError(f"cannot read {path} ({error})") from error
    seen: dict[tuple[Any, ...], int] = {}
    for k, row in enumerate(rows):
        if row.get("fingerprint") is None and row.get("person_seed") is None:
            continue  # the row does not identify a trial
        # Several human participants can play the same trial, so only all columns together identify a row.
        names = _TRIAL if is_simulated(row.get("user")) else sorted(row)
        first = seen.setdefault(tuple(str(row.get(name)) for name in names), k)
        if first != k:
            trial = ", ".join(f"{name} {row.get(name)}" for name in _TRIAL)
            raise RecordError(
                f"{path}: rows {first} and {k} are the same trial ({trial}); remove one of them"
            )
    return rows


def _types(schema: pa.Schema) -> dict[str, str]:
    return {field.name: str(field.type) for field in schema}


def _check_columns(schema: pa.Schema) -> None:
    found = _types(schema)
    written = json.loads((schema.metadata or {}).get(_WRITTEN, "{}"))
    renamed = sorted(found.keys() - written) if written.keys() - found else []
    if bad := [*renamed, *(name for name in found if written.get(name, found[name]) != found[name])]:
        raise ValueError(
            f"column {bad[0]!r} is not as it was written: the file is damaged, or the column was renamed or converted; "
            "then write the table without its metadata, with replace_schema_metadata() of pyarrow"
        )


def trial_columns() -> Columns:
    """Return the type and the description of each column in a table of trials."""
    found = described(TrialConfig, leave_out={"seed", "person", "behaviour"})
    found["fingerprint"] = ("str", "Hash of the settings and of everything else that the trial depends on.")
    found["rooms"] = ("int", "Number of rooms.")
    found["area_m2"] = ("float", "Floor area of the rooms, m2.")
    found["simulated"] = ("bool", "Whether the participant is simulated (all except `human`).")
    person = described(PersonParameters, leave_out=set(GROUPS))
    found |= {f"person_{name}": about for name, about in person.items()}
    found["behaviour_..."] = (
        "float",
        "Parameters of the participant model, if any (docs/participants.md).",
    )
    found |= {**described(Metrics), **described(Displays)}
    for name in HEALTH:
        for statistic, words in _STATISTICS.items():
            unit = name.rsplit("_", 1)[1]
            found[f"{statistic}_{name}"] = ("float", f"{words} {_QUANTITIES[name]}, {unit}.")
    found["releases_settled"] = ("int", "Number of released objects that came to rest.")
    found |= {name: ("int", f"Number of events `{kind.value}`.") for name, kind in COUNTED.items()}
    found["simulated_s"] = ("float", "Simulated time at the last state, s.")
    found["signal, error"] = ("str", "As in the event `end`, if present.")
    return found | _CIRCUMSTANCES
