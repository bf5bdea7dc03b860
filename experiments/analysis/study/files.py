"""Write the output files of an analysis: statistics, tables and the report."""

import csv
import io
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from experiments.analysis.statistics.effects import FTest
from experiments.analysis.statistics.mixed import WaldTest
from experiments.analysis.study.analysis import Analysis, Test, tests_of
from experiments.analysis.study.table import FILES, PEOPLE, REPORT, STATISTICS, TESTS, StudyTable
from experiments.record.files import write_json
from experiments.record.run_directory import check_file
from experiments.trials.trial_config import SEEDS
from mjsim.support.files import replacing, write_text_atomically

TEST_COLUMNS = (
    *("origin", "measure", "column", "test", "effect", "objects", "statistic", "df1", "df2", "people", "p"),
    *("partial_eta_squared", "low", "high", "of", "reason"),
)


def check_files(folder: Path, *, replace: bool) -> None:
    """Raise `RecordError` if the folder already contains an analysis, unless `replace` is true."""
    for name in FILES:
        check_file(folder / name, replace=replace)


def write_analysis(folder: Path, analysis: Analysis, report: str, further: Mapping[str, Any]) -> None:
    """Write the report (HTML) and the statistics of an analysis atomically. `further` contains more statistics."""
    folder.mkdir(parents=True, exist_ok=True)
    write_json(folder / STATISTICS, {**analysis.as_json(), **further})
    table = people_table(analysis.table)
    with replacing(folder / f"{PEOPLE}.parquet") as temporary, temporary.open("wb") as file:
        pa.parquet.write_table(table, file)
    with replacing(folder / f"{PEOPLE}.csv") as temporary, temporary.open("wb") as file:
        pa.csv.write_csv(table, file)
    write_text_atomically(folder / TESTS, _tests_csv(analysis))
    write_text_atomically(folder / REPORT, report)


def people_table(table: StudyTable) -> pa.Table:
    """Return a table with one row per participant, which contains the seeds, the cell and all measures."""
    columns: dict[str, Any] = {
        "origin": [table.origin] * len(table.rows),
        **{name: [row.get(name) for row in table.rows] for name in ("user", "participant", "house", *SEEDS)},
        "assistance": table.assistance,
        "objects": table.objects,
        **{name: table.numbers(name) for name in ("trial_number", "rooms", "area_m2")},
        "objects_per_m2": table.densities(),
        **table.columns,
    }
    found = pa.table({name: pa.array(values, from_pandas=True) for name, values in columns.items()})
    # Omit columns without values, because their type is unknown.
    return found.select([c for c in found.column_names if not pa.types.is_null(found.schema.field(c).type)])


def _tests_csv(analysis: Analysis) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, TEST_COLUMNS, lineterminator="\n", restval="")
    writer.writeheader()
    for result in analysis.results:
        same = {
            "origin": analysis.table.origin,
            "measure": result.measure,
            "column": analysis.table.sources.get(result.measure, result.measure),
            "test": result.kind,
            "objects": result.objects,
        }
        if result.reason is not None:
            writer.writerow({**same, "reason": result.reason})
        for effect, test in tests_of(result):
            writer.writerow({**same, "effect": effect, **_test_row(test)})
    return text.getvalue()


def _test_row(test: Test) -> Mapping[str, Any]:
    if isinstance(test, FTest):
        values = test.as_json()
        low, high = values.pop("interval") or ("", "")
        return {"partial_eta_squared": values.pop("eta_squared"), "low": low, "high": high, **values}
    values = asdict(test)
    return values if isinstance(test, WaldTest) else {"df1": values.pop("df"), **values}
