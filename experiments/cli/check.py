"""`mjsim check`: check a house, object or episode for errors."""

import argparse
import dataclasses
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.cli.doctor import require_extra
from experiments.cli.options import add_command, add_force

if TYPE_CHECKING:
    from mjsim.house.check import CheckReport

UNUSABLE = 2  # exit code if the checked input cannot be used

DESCRIPTION = """\
Check a house, an object, a receptacle or an episode against all conventions of docs/models.md, and list what to change.
For a house, one episode is sampled as well. The exit code is 0 if the subject can be used, even with warnings, and 2 if
it cannot: loading it would fail by the same rules."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "check", run, DESCRIPTION)
    parser.add_argument(
        "path",
        metavar="PATH",
        help="name, folder or catalogue.toml of a house, MJCF file of an object or a receptacle, or an episode.json",
    )
    parser.add_argument("--house", metavar="NAME", help="house to check an episode in (default: its own)")
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    parser.add_argument(
        "--picture",
        type=Path,
        metavar="FILE.png",
        help="draw the subject, with numbers that mark the findings",
    )
    add_force(parser, "replace an existing picture")


def run(arguments: argparse.Namespace) -> int:
    from experiments.record.run_directory import check_file
    from mjsim.generator.home_cache import load_catalogue
    from mjsim.house.check import check_path

    if arguments.picture is not None:
        require_extra("study")
        check_file(arguments.picture, replace=arguments.force)
    report = check_path(arguments.path, arguments.house, load_catalogue)
    if arguments.json:
        print(json.dumps(as_json(report), indent=2))
    else:
        _print(report)
    if arguments.picture is not None:
        from experiments.analysis.check_picture import draw_check

        draw_check(arguments.picture, report)
    return 0 if report.usable else UNUSABLE


def as_json(report: "CheckReport") -> dict[str, Any]:
    """Convert a report to a dictionary for JSON output. Its drawings are left out."""
    return {
        "path": report.path,
        "kind": report.kind,
        "usable": report.usable,
        "facts": dict(report.facts),
        "findings": [dataclasses.asdict(finding) for finding in report.findings],
    }


def _print(report: "CheckReport") -> None:
    from rich.console import Console
    from rich.table import Table

    from experiments.trials.design import counted

    console = Console(highlight=False)
    for name, fact in report.facts.items():
        console.print(f"{name}: {fact}", markup=False)
    if report.findings:
        table = Table(show_lines=True)
        for column in ("", "severity", "rule", "where", "what", "what to change"):
            table.add_column(column, overflow="fold")
        for number, found in enumerate(report.findings, 1):
            where = f"{found.subject} ({found.file})" if found.file else found.subject
            cells = (str(number), found.severity, found.rule, where, found.message, found.remedy)
            table.add_row(*(cell.replace("[", r"\[") for cell in cells))
        console.print(table)
    bad = sum(finding.severity == "error" for finding in report.findings)
    verdict = "can be used" if report.usable else "cannot be used"
    counts = f"{counted(bad, 'error')}, {counted(len(report.findings) - bad, 'warning')}"
    text = f"{report.kind} {report.path} {verdict}: {counts}"
    console.print(text, markup=False, soft_wrap=True)
