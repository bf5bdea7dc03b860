"""One table of many trials, as Parquet for analysis and CSV for the eye."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from experiments.errors import RecordError
from experiments.record.phases import is_simulated
from experiments.trials.trial_config import SEEDS
from mjsim.support.files import check_input, replacing

NAME = "trials"
_TRIAL = ("user", *SEEDS, "assistance", "objects", "fingerprint")  # equal for equal trials
_WRITTEN = (
    b"mjsim.columns"  # metadata: types of the columns by name, as the footer of Parquet has no checksum
)


def write_tables(folder: Path, rows: Sequence[Mapping[str, Any]]) -> tuple[Path, Path]:
    """Write `trials.parquet` and `trials.csv`, a row per trial, each whole or not at all; their paths in this order.

    Columns are the union of the rows' keys in order of first appearance.
    """
    columns = list(dict.fromkeys(key for row in rows for key in row))
    table = pa.table({c: [row.get(c) for row in rows] for c in columns})
    parquet, csv = folder / f"{NAME}.parquet", folder / f"{NAME}.csv"
    written = table.replace_schema_metadata({_WRITTEN: json.dumps(_types(table.schema))})
    # pyarrow gets files that are open: it takes no path that is not UTF-8, or that looks like the address of a server.
    with replacing(parquet) as temporary, temporary.open("wb") as file:
        pa.parquet.write_table(written, file, write_page_checksum=True)
    # An empty column has no type that CSV could hold.
    present = [c for c in columns if table[c].null_count < len(rows)]
    with replacing(csv) as temporary, temporary.open("wb") as file:
        pa.csv.write_csv(table.select(present), file)
    return parquet, csv


def read_rows(path: Path) -> list[dict[str, Any]]:
    """The rows of a Parquet file.

    Raises:
        RecordError: It cannot be read, is damaged, or has a trial twice.
    """
    try:
        check_input(path)
        with path.open("rb") as file:
            table = pa.parquet.read_table(file, page_checksum_verification=True)
        _check_columns(table.schema)
        rows: list[dict[str, Any]] = table.to_pylist()
    except (OSError, ValueError, pa.ArrowException) as error:
        raise RecordError(f"{path} cannot be read ({error})") from error
    seen: dict[tuple[Any, ...], int] = {}
    for k, row in enumerate(rows):
        if row.get("fingerprint") is None and row.get("person_seed") is None:
            continue  # nothing says who it is
        # People may play the same trial; they do not answer and walk alike.
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
    """Raise a `ValueError` if a column has another name or type than was written; columns may be added or left out."""
    found = _types(schema)
    written = json.loads((schema.metadata or {}).get(_WRITTEN, "{}"))
    renamed = sorted(found.keys() - written) if written.keys() - found else []
    if bad := [*renamed, *(name for name in found if written.get(name, found[name]) != found[name])]:
        raise ValueError(
            f"column {bad[0]!r} is not as it was written: the file is damaged, or the column was renamed or converted; "
            "then write the table without its metadata, with replace_schema_metadata() of pyarrow"
        )
