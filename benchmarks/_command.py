"""The command `mjsim bench`, which runs one of the benchmarks in this folder."""

import argparse
import importlib.util
import inspect
import json
import math
import os
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from experiments.cli.options import add_command, add_force, int_list
from experiments.errors import ConfigError

FOLDER = Path(__file__).resolve().parent
BUSY = 0.5  # load average per core above which wall-clock times are unreliable

DESCRIPTION = """\
Run a benchmark of the source checkout and print the results, as ratios where possible, so that they hold on other
machines as well. A benchmark is a module in benchmarks/ with measure() -> dict of JSON values, and lines(result) ->
lines of text. measure accepts some of the keywords quick, houses, count, hours, workers, only, parts, seeds, objects,
rooms, first_seed and out, which the options of the same names set. picture(result, path) may draw the result."""


def benchmark_names(folder: Path = FOLDER) -> tuple[str, ...]:
    return tuple(sorted(path.stem for path in folder.glob("*.py") if not path.stem.startswith("_")))


def benchmark(name: str, folder: Path = FOLDER) -> ModuleType:
    """Import the benchmark called `name`.

    Raises:
        ConfigError: There is no such benchmark, or the module does not define a benchmark.
    """
    names = benchmark_names(folder)
    if name not in names:
        raise ConfigError(f"no benchmark {name!r}; there are {', '.join(names)}")
    module = load(folder / f"{name}.py")
    if not (hasattr(module, "measure") and hasattr(module, "lines")):
        raise ConfigError(f"{folder / name}.py is not a benchmark; define measure() and lines(result)")
    return module


def load(path: Path) -> ModuleType:
    """Import a module from a file outside any package. Raise a `ConfigError` if it is not a Python file."""
    spec = importlib.util.spec_from_file_location(f"{path.parent.name}.{path.stem}", path)
    if spec is None or spec.loader is None:
        raise ConfigError(f"cannot load {path} as a module")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "bench", run, DESCRIPTION)
    names = ", ".join(benchmark_names())
    parser.add_argument("name", metavar="NAME", help=f"benchmark: {names}")
    parser.add_argument("--json", action="store_true", help="print the result as JSON")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="also draw the result")
    add_force(parser, "replace an existing picture")
    group = parser.add_argument_group("size of the benchmark (each benchmark has some of these options)")
    for name, kind, metavar, text in OPTIONS:
        group.add_argument(f"--{name.replace('_', '-')}", type=kind, metavar=metavar, help=text)
    group.add_argument("--quick", action="store_true", help="run a smaller benchmark")


def positive(text: str) -> int:
    if not text.isdecimal() or int(text) == 0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number above 0")
    return int(text)


def natural(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number")
    return int(text)


def positive_number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number above 0")
    return value


OPTIONS = (
    ("houses", positive, "N", "number of houses"),
    ("count", positive, "N", "number of cases"),
    ("hours", positive_number, "H", "simulated hours"),
    ("workers", positive, "N", "number of processes"),
    ("only", natural, "N", "run only the session with this number"),
    ("parts", lambda text: text.split(","), "NAME,..", "run only these parts"),
    ("seeds", positive, "N", "number of houses for each number of objects"),
    ("objects", int_list, "N,..", "numbers of objects"),
    ("rooms", int_list, "N,..", "sizes of homes, such as 1:11"),
    ("first_seed", natural, "N", "seed of the first home"),
    ("out", Path, "DIR", "folder for intermediate results, from which to resume"),
)


def options(module: ModuleType, arguments: argparse.Namespace) -> dict[str, Any]:
    """Return the options given on the command line as keyword arguments for the benchmark's `measure`.

    Raises:
        ConfigError: The benchmark does not support an option.
    """
    values = {name: getattr(arguments, name) for name in ("quick", *(name for name, *_ in OPTIONS))}
    given = {name: value for name, value in values.items() if value is not None and value is not False}
    for name in given:
        if name not in inspect.signature(module.measure).parameters:
            raise ConfigError(f"benchmark {arguments.name} has no option --{name}; leave it out")
    if arguments.picture is not None and not hasattr(module, "picture"):
        raise ConfigError(f"benchmark {arguments.name} has no option --picture; leave it out")
    return given


def run(arguments: argparse.Namespace) -> int:
    from experiments.record.run_directory import check_file

    module = benchmark(arguments.name)
    given = options(module, arguments)
    if arguments.picture is not None:
        check_file(arguments.picture, replace=arguments.force)
    if (load := os.getloadavg()[0] / (os.cpu_count() or 1)) > BUSY:
        print(
            f"mjsim: {load:.1f} processes per core were running in the last minute; rates in wall time will be "
            "too low: repeat this on an idle machine",
            file=sys.stderr,
        )
    result = module.measure(**given)
    if arguments.picture is not None:
        module.picture(result, arguments.picture)
    if arguments.json:
        print(json.dumps(result, indent=2))
    else:
        for line in module.lines(result):
            print(line)
    return 0
