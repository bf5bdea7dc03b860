"""Generate the data dictionary docs/data.md from the recorded types: `python -m tools.data_dictionary`."""

import inspect
import re
import sys
from collections.abc import Iterator, Mapping
from typing import Any

from experiments.record.events import OUTCOMES, TYPES, OutcomeEvent
from experiments.record.session_events import LoggedEvent
from experiments.trials.attributes import described
from experiments.trials.table import trial_columns

_HEAD = """\
# Data dictionary

`make data-dictionary` generates this page from the types. Lengths are in metres, times in simulated seconds, angles in
radians; z is up.

## metrics.json

One object per run. `mjsim metrics` computes all fields except the last three from event log and trajectory, and
`mjsim replay` checks them. [Metrics](metrics.md) has the definitions.
"""
_TABLES = """\
## trials.parquet, trials.csv

One row per trial of a batch, with the fields of `metrics.json` as columns. Unknown values are null, or empty in CSV.
CSV leaves out columns that are null throughout.

## trials/*.sqlar

[Packed trials](batches.md#packed-trials): SQLite databases with one table, `sqlar`, and one row per file.

| column | type | what |
|---|---|---|
| `name` | text | `TRIAL/FILE`, unique. |
| `mode` | int | File type and permissions, as `st_mode`. |
| `mtime` | int | Time of the last change, in seconds since 1970. |
| `sz` | int | Size of the file, in bytes. |
| `data` | blob | Content, compressed with zlib if that is shorter than `sz`. |
"""
_EVENTS = """\
## events.jsonl

One JSON object per line, in order of time. Every line has

| field | type | what |
|---|---|---|
"""


def data_dictionary() -> str:
    lines = [
        _HEAD,
        "| field | type | what |",
        "|---|---|---|",
        *_rows(trial_columns()),
        "",
        _TABLES,
        _EVENTS.rstrip(),
    ]
    lines += _rows(described(LoggedEvent))
    lines.append("| `event` | str | Kind of event, as in the headings below. |")
    for kind in TYPES:
        lines += ["", f"### {kind.__struct_config__.tag}", "", _summary(kind), "", *_table(kind)]
    lines += ["", "### Events of the world", "", "| event | when |", "|---|---|"]
    lines += [f"| `{kind.value}` | {when} |" for kind, when in OUTCOMES.items()]
    lines += ["", "Each has", "", *_table(OutcomeEvent)]
    return "\n".join(lines) + "\n"


def _table(kind: type[LoggedEvent]) -> list[str]:
    return ["| field | type | what |", "|---|---|---|", *_rows(described(kind))]


def _rows(columns: Mapping[str, tuple[str, str]]) -> Iterator[str]:
    for name, (type_name, what) in columns.items():
        shown = ", ".join(f"`{part}`" for part in name.split(", "))
        yield f"| {shown} | {_cell(type_name)} | {_cell(what)} |"


def _cell(text: str) -> str:
    linked = re.sub(r"`?docs/([\w-]+)\.md`?", r"[\1](\1.md)", text)
    return linked.replace("|", "\\|").replace("None", "null")


def _summary(kind: type[Any]) -> str:
    return (inspect.getdoc(kind) or "").split("\n\nAttributes:", 1)[0].replace("\n", " ")


def main() -> None:
    sys.stdout.write(data_dictionary())


if __name__ == "__main__":
    main()
