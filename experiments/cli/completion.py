"""`mjsim completion`: print a shell completion script."""

import argparse
import re
from pathlib import Path
from typing import Any

from experiments.cli.options import add_command

DESCRIPTION = "Print a script with which a shell completes commands, options, their values and file names."

EPILOG = """\
examples:
  mjsim completion bash > ~/.local/share/bash-completion/completions/mjsim
      for new bash shells
  mjsim completion zsh > ~/.zfunc/_mjsim
      for zsh, if fpath contains ~/.zfunc"""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "completion", run, DESCRIPTION)
    parser.epilog = EPILOG
    parser.add_argument("shell", choices=("bash", "zsh"), help="shell that will run the script")


def run(arguments: argparse.Namespace) -> int:
    import shtab

    from experiments.cli.main import COMMANDS, parser  # imported here because `main` imports this module

    top = parser(*COMMANDS)
    _complete_files(top, shtab.FILE)
    print(shtab.complete(top, arguments.shell))
    return 0


def _complete_files(parser: argparse.ArgumentParser, files: object) -> None:
    for action in parser._actions:  # argparse has no public attribute for a parser's actions
        if action.type is Path or re.search(r"\.[a-z]", str(action.metavar)):
            action.complete = files  # type: ignore[attr-defined]
        elif isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                _complete_files(command, files)
