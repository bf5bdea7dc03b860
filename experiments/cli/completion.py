"""`mjsim completion`: commands, options and files at the tab key."""

import argparse
import re
from pathlib import Path
from typing import Any

DESCRIPTION = "Print a script that lets a shell complete commands, options, their values and names of files."

EPILOG = """\
examples:
  mjsim completion bash > ~/.local/share/bash-completion/completions/mjsim
      for every new bash
  mjsim completion zsh > ~/.zfunc/_mjsim
      for zsh, where ~/.zfunc is in fpath"""


def add_parser(commands: Any) -> None:
    parser: argparse.ArgumentParser = commands.add_parser(
        "completion",
        help=None,  # lets it list itself
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("shell", choices=("bash", "zsh"), help="the shell")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    import shtab

    from experiments.cli.main import COMMANDS, parser  # which loads this module

    top = parser(*COMMANDS)
    _complete_files(top, shtab.FILE)
    print(shtab.complete(top, arguments.shell))
    return 0


def _complete_files(parser: argparse.ArgumentParser, files: object) -> None:
    """Complete names of files where a command takes a path, or a file or `-`."""
    for action in parser._actions:  # argparse has no public list of them
        if action.type is Path or re.search(r"\.[a-z]", str(action.metavar)):
            action.complete = files  # type: ignore[attr-defined]
        elif isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                _complete_files(command, files)
