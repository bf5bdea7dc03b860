"""The command `mjsim study calibrate`, which fits the `guest` model to the published results."""

import argparse
from pathlib import Path
from typing import Any

from experiments.cli.doctor import require_extra
from experiments.cli.options import add_command, add_force

DESCRIPTION = """\
Fit the free parameters of the participant model `guest` (studies/calibration.toml) to the published results at 6
objects. Results over several numbers of objects are not used. DIR is a pool of simulated people whose parameters vary
widely:

  mjsim study simulate pool --people 900 --out runs/pool     # resumes after an interruption
  mjsim study calibrate runs/pool

The method is approximate Bayesian computation. The pool trains a surrogate that predicts trials. Populations are drawn
from the priors, and those whose predicted studies are closest to the published one are kept. Files:

  calibration.html    report: identifiable parameters, correlations between parameters, accuracy of the surrogate
  calibration.json    the same numbers
  kept.csv            parameters of the populations that were kept
  study.toml          study with the best population, to confirm the fit with `mjsim study simulate`

If that study differs from the surrogate's prediction, calibrate again and name its folder as well: its people at 6
objects are then added to the training data.

A good fit does not mean that the model is true. docs/paper.md explains what can be concluded."""


def add_parser(commands: Any) -> None:
    """Add the subcommand `calibrate` to `mjsim study`."""
    parser = add_command(
        commands, "calibrate", run, DESCRIPTION, "fit the guest to the published rows at 6 objects"
    )
    parser.add_argument(
        "folders", type=Path, nargs="+", metavar="DIR", help="folder of a pool; results go to the first"
    )
    parser.add_argument(
        "--study",
        default="paper",
        metavar="STUDY.toml",
        help="study whose population is fitted (default: %(default)s)",
    )
    parser.add_argument(
        "--draws",
        type=int,
        default=10_000,
        metavar="N",
        help="number of populations to draw (default: %(default)s)",
    )
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="seed of the random draws")
    parser.add_argument("--out", type=Path, metavar="DIR", help="output folder (default: DIR/calibration)")
    add_force(parser, "replace an earlier calibration")


def run(arguments: argparse.Namespace) -> int:
    """Calibrate, write the results, and print their path.

    Raises:
        ConfigError: An option is invalid, or a file of the package cannot be used.
        RecordError: The folder is not a pool, or output files already exist.
        StatisticsError: The pool is too small.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn

    from experiments.cli.terminal import error_console, progress_bars

    require_extra("study")
    from experiments.analysis.study.measures import read_measures
    from experiments.analysis.study.table import read_study
    from experiments.errors import ConfigError
    from experiments.record.run_directory import check_file
    from experiments.trials.designs import study_path
    from studies.calibration.calibrate import calibrate
    from studies.calibration.files import FILES, PAGE, write_calibration
    from studies.calibration.population import read_free_parameters
    from studies.published import read_published

    if arguments.draws < 100 or arguments.seed < 0:
        raise ConfigError(
            f"--draws {arguments.draws} must be 100 or more, and --seed {arguments.seed} 0 or more"
        )
    out = arguments.folders[0] / "calibration" if arguments.out is None else arguments.out
    for name in FILES:
        check_file(out / name, replace=arguments.force)
    pools = [read_study(folder, read_measures()) for folder in arguments.folders]
    columns = TextColumn("populations"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    with progress_bars(error_console(), *columns) as bars:
        bar = bars.add_task("populations", total=arguments.draws)
        found = calibrate(
            pools,
            read_free_parameters(),
            read_published(),
            draws=arguments.draws,
            seed=arguments.seed,
            on_progress=lambda done: bars.update(bar, completed=done),
        )
    write_calibration(out, found, study_path(arguments.study))
    print(f"{found.origin}: {out / PAGE}")
    for line in (line for pool in pools for line in pool.absent()):
        print(line)
    return 0
