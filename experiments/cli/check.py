"""`mjsim check`: what is wrong with a house, an object or an episode, and what to change."""

import argparse
import dataclasses
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.cli.options import add_command, add_force
from experiments.cli.requirements import require_extra

if TYPE_CHECKING:
    from mjsim.house.check import CheckReport

UNUSABLE = 2

DESCRIPTION = """\
Check a house, an object, a receptacle or an episode against every convention of docs/models.md, and say what to change.
A house is also sampled once. The exit code is 0 where it can be used, warnings or not, and 2 where it cannot.
Loading refuses by the same rules."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "check", run, description=DESCRIPTION)
    parser.add_argument(
        "path",
        metavar="PATH",
        help="catalogue.toml of a house, its folder or its name; MJCF file of an object or a receptacle; episode.json",
    )
    parser.add_argument(
        "--house",
        metavar="NAME",
        help="house of an episode, if not its own",
    )
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    parser.add_argument(
        "--picture", type=Path, metavar="FILE.png", help="draw it, with every finding numbered where it is"
    )
    add_force(parser, "replace a picture that exists")


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
    """The report without its drawings, as JSON values."""
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
    counts = f"{_counted(bad, 'error')}, {_counted(len(report.findings) - bad, 'warning')}"
    text = f"{report.kind} {report.path} {verdict}: {counts}"
    console.print(text, markup=False, soft_wrap=True)


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
