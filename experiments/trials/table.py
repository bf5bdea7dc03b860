"""One table of many trials, as Parquet for analysis and CSV for the eye."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from mjsim.files import replacing

NAME = "trials"


def write_tables(folder: Path, rows: Sequence[Mapping[str, Any]]) -> tuple[Path, Path]:
    """Write `trials.parquet` and `trials.csv`, a row per trial, each whole or not at all; their paths in this order.

    Columns are the union of the rows' keys in order of first appearance.
    """
    columns = list(dict.fromkeys(key for row in rows for key in row))
    table = pa.table({c: [row.get(c) for row in rows] for c in columns})
    parquet, csv = folder / f"{NAME}.parquet", folder / f"{NAME}.csv"
    with replacing(parquet) as temporary:
        pa.parquet.write_table(table, temporary)
    # An empty column has no type that CSV could hold.
    present = [c for c in columns if table[c].null_count < len(rows)]
    with replacing(csv) as temporary:
        pa.csv.write_csv(table.select(present), temporary)
    return parquet, csv
