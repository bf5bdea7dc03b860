"""What a command needs beyond the base installation, reported in one line where it is missing."""

import argparse
import importlib
import importlib.util
from typing import Any, NoReturn

from experiments.errors import ConfigError

EXTRAS = {
    "study": ("matplotlib", "statsmodels"),
    "people": ("argon2", "httpx", "prometheus_client"),
}  # name of an extra -> modules that it brings


def require_extra(extra: str) -> None:
    for module in EXTRAS[extra]:
        if importlib.util.find_spec(module) is None:
            raise ConfigError(f"this needs {module}, which is not installed: pip install 'mjsim[{extra}]'")


def add_checkout_command(commands: Any, name: str, module: str) -> None:
    """Add the subcommand of a module that only the source checkout may have; elsewhere it reports what it needs."""
    try:
        importlib.import_module(module).add_parser(commands)
    except ModuleNotFoundError as error:
        if not module.startswith(str(error.name)):
            raise
        # No prefix for options: whatever follows is taken, and answered by what is missing.
        parser = commands.add_parser(
            name, help="needs the source checkout", add_help=False, prefix_chars="\0"
        )
        parser.add_argument("options", nargs="*")
        parser.set_defaults(run=_refuse)


def _refuse(_: argparse.Namespace) -> NoReturn:
    raise ConfigError(
        "this command needs the source checkout, which the installed package lacks: clone the repository and "
        "install it with `pip install --editable .`"
    )
