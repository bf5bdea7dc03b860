"""`mjsim metrics`: recompute the metrics of runs and batches."""

import argparse
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.cli.options import add_command, add_force
from experiments.errors import RecordError, ReplayError
from experiments.study.data.copies import note_derived
from mjsim.support.files import write_text_atomically

DESCRIPTION = """\
Compute the metrics of a run, a batch or the visits of `mjsim play` from event log and trajectory. For a run, print one
metric per line. Otherwise, print CSV with one row per trial. --out writes CSV or JSON to a file instead.

The SHA-256 of each file that is read must match the recorded one (`mjsim replay` verifies everything). Metrics with
several definitions are listed side by side:

  nd_strict_2n     visits that differ from the suggested one, over twice the number of objects
  nd_feasible      visits that differ from the suggested one, over the visits with a feasible alternative
  nd_bin_tied      as nd_feasible, but not counting which object goes into a bin first
  nd_regret_10cm   as nd_feasible, but counting only deviations that cost more than 0.1 m
  ipl_locations    distances between the places of visits, over the distance walked (the paper's; can exceed 1)
  ipl_stand        shortest walks between the positions at visits, over the distance walked (at most 1)

docs/metrics.md defines all metrics. docs/data.md lists the fields of all files."""
FORMATS = (".csv", ".json")


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "metrics", run, DESCRIPTION)
    parser.add_argument(
        "directory", type=Path, metavar="DIR", help="run directory, or folder of a batch or of `mjsim play`"
    )
    parser.add_argument(
        "--out", type=_table_file, metavar="FILE", help=f"file to write ({' or '.join(FORMATS)})"
    )
    add_force(parser, "replace an existing file")


def run(arguments: argparse.Namespace) -> int:
    from experiments.record.archive import archive_of, run_paths
    from experiments.record.phases import TASK
    from experiments.record.run_directory import TRIALS, check_file, is_batch, is_run, visit_folders

    check_file(arguments.out, replace=arguments.force)
    is_one = is_run(arguments.directory) or archive_of(arguments.directory) is not None
    if is_one:
        rows, failures = [_measured(arguments.directory)], 0
    elif is_batch(arguments.directory):
        rows, failures = _measure_all({path: {} for path in run_paths(arguments.directory / TRIALS)})
    elif found := visit_folders(arguments.directory):
        rows, failures = _measure_all(
            {
                p / TASK: {"participant": str(p.relative_to(arguments.directory))}
                for p in found
                if is_run(p / TASK)
            }
        )
    else:
        raise RecordError(
            f"{arguments.directory} is neither a run directory nor the folder of a batch or of `mjsim play`"
        )
    if arguments.out is not None:
        note_derived(arguments.directory, "metrics", arguments.out)
        write_text_atomically(arguments.out, _text(rows, arguments.out.suffix))
    elif is_one:
        sys.stdout.writelines(f"{name:<32} {_shown(value)}\n" for name, value in rows[0].items())
    else:
        sys.stdout.write(_text(rows, ".csv"))
    return 1 if failures else 0


def _table_file(text: str) -> Path:
    path = Path(text)
    if path.suffix not in FORMATS:
        raise argparse.ArgumentTypeError(f"{text!r} does not end in .csv or .json")
    return path


def _measured(path: Path) -> Mapping[str, Any]:
    from experiments.record.archive import opened_run
    from experiments.record.verify import check_log
    from experiments.trials.batch_folder import read_trial

    with opened_run(path) as run:
        check_log(run)
        trial = read_trial(run, recompute=True)
    if not trial.as_measured:
        print(
            f"mjsim: {path}: metrics.json differs from these metrics of the log, or is missing",
            file=sys.stderr,
        )
    return trial.row


def _measure_all(runs: Mapping[Path, Mapping[str, Any]]) -> tuple[list[Mapping[str, Any]], int]:
    rows: list[Mapping[str, Any]] = []
    failures = 0
    for path, columns in runs.items():
        try:
            rows.append({**columns, **_measured(path)})
        except (RecordError, ReplayError) as error:
            failures += 1
            print(f"mjsim: {error}", file=sys.stderr)
    return rows, failures


def _text(rows: list[Mapping[str, Any]], suffix: str) -> str:
    from experiments.record.files import csv_text

    if suffix == ".json":
        return json.dumps(rows, indent=2) + "\n"
    columns = list(dict.fromkeys(name for row in rows for name in row))
    return csv_text(columns, ([_shown(row.get(name)) for name in columns] for row in rows))


def _shown(value: Any) -> str:
    if value is None:
        return ""
    return value if isinstance(value, str) else json.dumps(value)
