"""The `mjsim doctor` command, and checks for the optional dependencies of other commands."""

import argparse
import importlib
import importlib.util
from typing import Any, NoReturn

from experiments.errors import ConfigError

DESCRIPTION = """\
Show versions, the EGL vendor, the GL renderer, and whether rendering happens in software. List missing software and how
to install it, and other installed packages that are also named planner, hud or experiments. The exit code is 1 if
frames cannot be rendered, software is missing, or Python imports another package in place of one of ours."""

# Modules that are installed by each optional extra of the package
EXTRAS = {
    "study": ("matplotlib", "statsmodels"),
    "people": ("argon2", "httpx", "prometheus_client"),
}


def add_parser(commands: Any) -> None:
    parser: argparse.ArgumentParser = commands.add_parser(
        "doctor",
        help=None,  # completion scripts omit commands that have no `help` argument
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:  # noqa: ARG001 - the signature of all subcommands
    from mjsim.render.diagnostics import environment_report

    report = environment_report()
    for line in report.lines():
        print(line)
    return 0 if report.usable else 1


def require_extra(extra: str) -> None:
    for module in EXTRAS[extra]:
        if importlib.util.find_spec(module) is None:
            raise ConfigError(f"this needs {module}, which is not installed: pip install 'mjsim[{extra}]'")


def add_checkout_command(commands: Any, name: str, module: str) -> None:
    """Add a subcommand that is only available in a source checkout.

    In an installed package, add a placeholder that raises a `ConfigError` when it is called.
    """
    try:
        importlib.import_module(module).add_parser(commands)
    except ModuleNotFoundError as error:
        if not module.startswith(str(error.name)):
            raise
        # No argument can start with a null character, so the parser treats options as positional arguments.
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
