"""`mjsim bench`: the benchmarks of the source checkout, one module each in `benchmarks/`."""

import argparse
import importlib.util
import json
from pathlib import Path
from types import ModuleType
from typing import Any

from experiments.errors import ConfigError

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"

DESCRIPTION = """\
Run a benchmark of the source checkout and print what it measured. Figures are ratios where they can be, so that they
hold on another machine as well. A module in benchmarks/ is a benchmark when it defines measure() -> dict of JSON values
and lines(result) -> lines of text."""


def benchmark_names(folder: Path = FOLDER) -> tuple[str, ...]:
    """Names of the benchmarks, sorted; none where only the wheel is installed."""
    return tuple(sorted(path.stem for path in folder.glob("*.py") if not path.stem.startswith("_")))


def benchmark(name: str, folder: Path = FOLDER) -> ModuleType:
    """Load the benchmark called `name`.

    Raises:
        ConfigError: There is no source checkout, no such benchmark, or the module is none.
    """
    names = benchmark_names(folder)
    if not names:
        raise ConfigError(
            "benchmarks live in the source checkout, not in the installed package; clone the repository, install it "
            "with `pip install --editable .` and run `mjsim bench` there"
        )
    if name not in names:
        raise ConfigError(f"no benchmark {name!r}; there are {', '.join(names)}")
    spec = importlib.util.spec_from_file_location(f"benchmarks.{name}", folder / f"{name}.py")
    if spec is None or spec.loader is None:
        raise ConfigError(f"{folder / name}.py cannot be loaded as a module")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    if not (hasattr(module, "measure") and hasattr(module, "lines")):
        raise ConfigError(f"{folder / name}.py is no benchmark; define measure() and lines(result)")
    return module


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser: argparse.ArgumentParser = commands.add_parser(
        "bench",
        help="run a benchmark of the source checkout",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "name", metavar="NAME", help=f"benchmark: {', '.join(benchmark_names()) or 'none here'}"
    )
    parser.add_argument("--json", action="store_true", help="print the result as JSON")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Measure and print."""
    module = benchmark(arguments.name)
    result = module.measure()
    if arguments.json:
        print(json.dumps(result, indent=2))
    else:
        for line in module.lines(result):
            print(line)
    return 0
