"""Tables of trials: what is read is what was written, also where a byte of the footer was changed."""

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from experiments.errors import RecordError
from experiments.trials.table import read_rows, write_tables

ROWS = [
    {
        "user": "guest",
        "person_seed": k,
        "objects": 6,
        "fingerprint": f"f{k}",
        "nd_feasible": k / 3,
        "ok": True,
    }
    for k in range(3)
]


@pytest.fixture
def table(tmp_path):
    return write_tables(tmp_path, ROWS)[0]


@pytest.mark.parametrize("name", ["a\udcffb", "file:a", "ünïcode"])
def test_folders_may_have_any_name(name, tmp_path):
    (tmp_path / name).mkdir()
    parquet, csv = write_tables(tmp_path / name, ROWS)
    assert read_rows(parquet) == ROWS and csv.is_file()


@pytest.mark.slow
def test_a_changed_byte_of_the_footer_is_refused_or_changes_nothing(table):
    data = table.read_bytes()
    footer = len(data) - 8 - int.from_bytes(data[-8:-4], "little")
    refused = 0
    for place in range(footer, len(data)):
        table.write_bytes(bytes((*data[:place], data[place] ^ 0x20, *data[place + 1 :])))
        try:
            assert read_rows(table) == ROWS, f"byte {place - footer} of the footer"
        except RecordError:
            refused += 1
    assert refused > 100


def test_a_column_whose_name_was_damaged_is_named(table):
    data = table.read_bytes()
    table.write_bytes(data.replace(b"nd_feasible", b"nd_feasiblf", 1))
    with pytest.raises(
        RecordError, match="column 'nd_feasiblf' is not as it was written: the file is damaged"
    ):
        read_rows(table)


@pytest.mark.parametrize(
    "change",
    [
        lambda table: table.append_column("likert_useful", pa.array([1, 2, 3])),
        lambda table: table.drop_columns(["ok", "nd_feasible"]),
        lambda table: table.rename_columns(
            [name.upper() for name in table.column_names]
        ).replace_schema_metadata(),
    ],
)
def test_columns_may_be_added_left_out_and_renamed(change, table):
    changed = change(pq.read_table(table))
    pq.write_table(changed, table)
    assert read_rows(table) == changed.to_pylist()
