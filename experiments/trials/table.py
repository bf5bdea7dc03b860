"""One table of many trials, as Parquet for analysis and CSV for the eye."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from experiments.errors import RecordError
from experiments.record.origin import is_simulated
from experiments.trials.trial_config import SEEDS
from mjsim.files import check_input, replacing

NAME = "trials"
_TRIAL = ("user", *SEEDS, "assistance", "objects", "fingerprint")  # equal for equal trials


def write_tables(folder: Path, rows: Sequence[Mapping[str, Any]]) -> tuple[Path, Path]:
    """Write `trials.parquet` and `trials.csv`, a row per trial, each whole or not at all; their paths in this order.

    Columns are the union of the rows' keys in order of first appearance.
    """
    columns = list(dict.fromkeys(key for row in rows for key in row))
    table = pa.table({c: [row.get(c) for row in rows] for c in columns})
    parquet, csv = folder / f"{NAME}.parquet", folder / f"{NAME}.csv"
    with replacing(parquet) as temporary:
        pa.parquet.write_table(table, temporary, write_page_checksum=True)
    # An empty column has no type that CSV could hold.
    present = [c for c in columns if table[c].null_count < len(rows)]
    with replacing(csv) as temporary:
        pa.csv.write_csv(table.select(present), temporary)
    return parquet, csv


def read_rows(path: Path) -> list[dict[str, Any]]:
    """The rows of a Parquet file.

    Raises:
        RecordError: It cannot be read, or has a trial twice.
    """
    try:
        check_input(path)
        rows: list[dict[str, Any]] = pa.parquet.read_table(path, page_checksum_verification=True).to_pylist()
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
