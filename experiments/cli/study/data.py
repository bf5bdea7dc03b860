"""Subcommands of `mjsim study` that manage study data, such as collect, export, backup and erase."""

import argparse
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.cli.doctor import require_extra
from experiments.cli.options import add_command, add_force
from experiments.cli.study.database import (
    DATABASE,
    add_database,
    add_served_study,
    people_study,
    sqlite_url,
    with_store,
)
from experiments.errors import ConfigError, RecordError
from experiments.session.signals import run_until_signal
from experiments.trials.design import counted
from mjsim.support.urls import redacted

if TYPE_CHECKING:
    from experiments.visit.store import Store

_USER = re.compile(r"[^/]*:[^/]*@")  # the start of a URL without its scheme, which may contain a password

COLLECT = """\
Write what the participants of a study did and answered as tidy tables: OUT/trials.parquet and OUT/trials.csv with a row
per participant who ended the task, for `mjsim study analyze`, `compare` and `score`, and OUT/texts.csv with free-text
answers. Columns likert_NAME hold answers on a scale, columns answer_NAME all others. The tables contain no platform ids
and no addresses.

DIR is a folder of `mjsim study serve`, which may be running, a folder of `mjsim play`, or a folder of several of these.
Participants of `mjsim play` have no answers."""

EXPORT = """\
Write all data of a study to a new folder in the Psych-DS layout: tidy tables (data/), run directories of trials
(runs/PERSON/PHASE), and a description of each column (documentation/codebook.csv, dataset_description.json). Numbers
identify participants. The export has no platform ids, links, hashes of links or addresses, and no data of participants
who did not agree or who wanted their data deleted. The folder is written atomically.

Free-text answers are in a separate table: read them before you publish the export."""

RECONCILE = """\
Mark participants that the recruitment platform does not know, such as those with invented ids. SUBMISSIONS is the list
of the study's submissions (CSV) from the page of Prolific, Connect or the ExternalQuestion platform. A participant is
known if the ids of person and submission are in the same line. Collected tables have the column recruitment_known, for
[exclusions]. Repeat the command with a newer list at any time."""

BACKUP = """\
Write a consistent snapshot of a study's database to a new file, even while the study is served. The backup does not
include journals and run directories: copy the folder DIR as well."""

RESTORE = """\
Restore a backup of `mjsim study backup` to an empty database. The database may be of another kind than the original,
for example to move a study from a file to a database server. A database that holds a study is refused."""

ERASE = """\
Delete all data of a participant: database rows, journals and runs. Backups, restored databases, tables and exports are
rewritten without the participant. Analyses, metrics, films and pages that include the participant are deleted, so that
you have to make them again. A file that was moved is listed with what to do. The audit log keeps the fact of the
erasure and the payments made. Participants who are owed a payment must be paid first."""

FORGET = """\
Delete identifying data of participants who were last active more than keep_days ([study.limits]) ago: platform ids,
keys that recognize participants, and links, also in the backups that the study knows of. Behaviour and answers are kept
under a number, but participants who wanted their data deleted are erased. Participants who are owed a payment are kept
until they are paid. The server does the same daily. Run this command after the study."""


def add_parser(commands: Any) -> None:
    parser = _add(commands, "collect", run_collect, COLLECT, "write the tables of a study")
    parser.add_argument("--out", type=Path, required=True, metavar="OUT", help="folder for the tables")
    parser.add_argument(
        "--rehearsal", action="store_true", help="DIR is of a rehearsal, with simulated participants"
    )
    add_force(parser, "replace existing tables")
    parser = _add(commands, "export", run_export, EXPORT, "export all data of a study")
    parser.add_argument("--out", type=Path, required=True, metavar="EXPORT", help="folder to create")
    add_force(parser, "replace an earlier export")
    parser = _add(
        commands, "reconcile", run_reconcile, RECONCILE, "mark participants that the platform does not know"
    )
    parser.add_argument("submissions", type=Path, metavar="SUBMISSIONS.csv", help="list from the platform")
    parser.add_argument(
        "--who", default="mjsim", metavar="NAME", help="name of the person who does this, for the audit log"
    )
    parser = _add(commands, "backup", run_backup, BACKUP, "back up the database of a study")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.db", help="file to write")
    parser = add_command(commands, "restore", run_restore, RESTORE, "restore a backup to an empty database")
    parser.add_argument("backup", type=Path, metavar="FILE.db", help="backup to read")
    parser.add_argument(
        "database", metavar="DATABASE", help="path of a new SQLite file, or URL of an empty database"
    )
    parser = _add(commands, "erase", run_erase, ERASE, "delete all data of a participant")
    parser.add_argument("person", metavar="PERSON", help="participant as named in tables, such as p00012")
    parser.add_argument(
        "--who", required=True, metavar="NAME", help="name of the person who deletes, for the audit log"
    )
    parser = _add(commands, "forget", run_forget, FORGET, "delete identifying data by date")
    parser.add_argument(
        "--dry-run", action="store_true", help="list what would be deleted, but delete nothing"
    )


def _add(commands: Any, name: str, run: Any, description: str, summary: str) -> argparse.ArgumentParser:
    parser = add_command(commands, name, run, description, summary)
    add_served_study(parser)
    add_database(parser)
    return parser


def run_collect(arguments: argparse.Namespace) -> int:
    require_extra("people")
    from experiments.analysis.study.measures import SURVEY
    from experiments.record.run_directory import check_file
    from experiments.study.data.collect import TEXTS, collect, collect_visits, write_collected
    from experiments.study.data.copies import note_copy, note_derived
    from experiments.trials.table import NAME

    for name in (f"{NAME}.parquet", f"{NAME}.csv", TEXTS, SURVEY):
        check_file(arguments.out / name, replace=arguments.force)
    is_study = _is_study_folder(arguments)
    if is_study:
        study = replace(people_study(arguments), rehearsal=arguments.rehearsal)
        found = with_store(study, arguments, lambda store: collect(study, store, arguments.folder))
    else:
        found = collect_visits(arguments.folder)
    _print_faults(found.unusable)
    if not found.rows:
        raise RecordError(
            f"no participant in {arguments.folder} has finished the task; there is no table to write"
        )
    (note_copy if is_study else note_derived)(arguments.folder, "table", arguments.out)
    table, *_ = write_collected(found, arguments.out)
    others = ", ".join(f"{number} {status.replace('_', ' ')}" for status, number in found.unfinished.items())
    print(f"{table} ({counted(len(found.rows), 'row')}; participants without a row: {others or 'none'})")
    return 1 if found.unusable else 0


def _is_study_folder(arguments: argparse.Namespace) -> bool:
    from experiments.record.run_directory import visit_folders

    has_database = bool(arguments.database) or (arguments.folder / DATABASE).is_file()
    return has_database or not visit_folders(arguments.folder)


def _print_faults(unusable: Any) -> None:
    for person, fault in unusable.items():
        print(f"mjsim: {person}: {fault}", file=sys.stderr)


def run_export(arguments: argparse.Namespace) -> int:
    study = people_study(arguments)
    from experiments.study.data.export import check_export, export

    folder, out, force = arguments.folder, arguments.out, arguments.force
    check_export(out, replace=force)
    found = with_store(study, arguments, lambda store: export(study, store, folder, out, replace=force))
    _print_faults(found.collected.unusable)
    print(f"{arguments.out} ({found.people} people, {found.runs} runs)")
    return 1 if found.collected.unusable else 0


def run_reconcile(arguments: argparse.Namespace) -> int:
    study = people_study(arguments)
    from experiments.study.recruitment.reconcile import reconcile

    file, who = arguments.submissions, arguments.who
    known = with_store(study, arguments, lambda store: reconcile(study, store, file, who))
    print(f"{sum(known.values())} of {len(known)} participants are known to the platform")
    print(f"unknown: {', '.join(name for name in known if not known[name]) or 'no participant'}")
    return 0


def run_backup(arguments: argparse.Namespace) -> int:
    with_store(people_study(arguments), arguments, lambda store: _back_up(store, arguments))
    print(f"{arguments.out} (restore it with `mjsim study restore {arguments.out} {DATABASE}`)")
    return 0


async def _back_up(store: "Store", arguments: argparse.Namespace) -> None:
    from experiments.study.data.copies import note_copy
    from experiments.visit.store.copies import check_new

    check_new(arguments.out)  # must come before `note_copy`, which would record an existing file as a copy
    note_copy(arguments.folder, "backup", arguments.out)
    await store.backup(arguments.out)


def run_restore(arguments: argparse.Namespace) -> int:
    require_extra("people")
    from experiments.study.data.copies import note_derived
    from experiments.visit.store import restore

    url = arguments.database
    if "://" not in url:
        if _USER.match(url):
            raise ConfigError("DATABASE begins with a user; write it as postgresql://USER:PASSWORD@HOST/NAME")
        note_derived(Path(url), "database", Path(url))
        note_derived(arguments.backup, "database", Path(url))
    run_until_signal(restore(arguments.backup, url if "://" in url else sqlite_url(Path(url))))
    print(redacted(url))
    return 0


def run_erase(arguments: argparse.Namespace) -> int:
    study = people_study(arguments)
    from experiments.study.data.erase import erase

    person, who = arguments.person, arguments.who
    for line in with_store(study, arguments, lambda store: erase(store, arguments.folder, person, who)):
        print(line)
    print(f"{arguments.person} is deleted")
    return 0


def run_forget(arguments: argparse.Namespace) -> int:
    study = people_study(arguments)
    from experiments.study.data.retention import forget_old
    from experiments.visit.folders import VISITS

    visits, days, dry = arguments.folder / VISITS, study.settings.limits.keep_days, arguments.dry_run
    if days is None:
        raise ConfigError(f"{study.path} has no keep_days in [study.limits]; nothing is deleted by date")
    found = with_store(study, arguments, lambda store: forget_old(store, visits, days, dry=dry))
    for what, names in (
        ("forgotten", found.forgotten),
        ("erased", found.erased),
        ("not paid yet", found.unpaid),
    ):
        print(f"{what}: {', '.join(names) or 'no participant'}")
    return 0
