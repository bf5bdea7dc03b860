"""`mjsim study power`: estimate the sample size that a study needs by simulating participants."""

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import Any

from experiments.cli.doctor import require_extra
from experiments.cli.options import add_command, add_force, int_list

DESCRIPTION = """\
Compute how many people each cell of a study needs to detect an effect, with the cost and the hours of work. The
variance between people is estimated from a pool: a folder of simulated participants in the same cells, at least 10 per
cell. With 200 per cell, the interval is narrow.

The effect is a difference of means (--difference), a partial eta squared (--eta-squared), or, without these options,
the effect in the pool. It is unknown whether simulated participants vary as much as real ones. docs/analysis.md
explains the consequences."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "power", run, DESCRIPTION, "compute the sample size of a study")
    parser.add_argument("study", metavar="STUDY.toml", help="study file or design (docs/batches.md)")
    parser.add_argument(
        "--pool", type=Path, required=True, metavar="DIR", help="folder of simulated participants"
    )
    parser.add_argument(
        "--measure", default="deviations", metavar="NAME", help="measure: deviations, ipl, distance or time"
    )
    parser.add_argument(
        "--effect", default="assistance", metavar="NAME", help="effect: assistance, objects or interaction"
    )
    parser.add_argument(
        "--difference",
        type=float,
        metavar="D",
        help="largest difference of means to detect, in units of the measure",
    )
    parser.add_argument("--eta-squared", type=float, metavar="E", help="partial eta squared to detect")
    parser.add_argument(
        "--power", type=float, default=0.8, metavar="P", help="probability of detecting the effect"
    )
    parser.add_argument("--alpha", type=float, default=0.05, metavar="P", help="significance level")
    parser.add_argument("--pay", type=float, default=7.5, metavar="X", help="pay of a person who finishes")
    parser.add_argument(
        "--fee", type=float, default=0.0, metavar="X", help="platform fee as a share of the pay"
    )
    parser.add_argument(
        "--minutes", type=float, default=25.0, metavar="M", help="minutes that a person takes"
    )
    parser.add_argument(
        "--dropout", type=float, default=0.15, metavar="P", help="share of people who do not finish"
    )
    parser.add_argument(
        "--homes",
        type=int_list,
        metavar="N,..",
        help="compute the power for these numbers of homes instead; people in the pool need trials in several homes "
        "(trials_per_person)",
    )
    parser.add_argument(
        "--people",
        type=int_list,
        default="10,20,50,100",
        metavar="N,..",
        help="with --homes: numbers of people per condition",
    )
    parser.add_argument(
        "--trials", type=int, default=1, metavar="N", help="with --homes: number of trials per person"
    )
    parser.add_argument("--plot", type=Path, metavar="FILE", help="with --homes: PNG figure to write")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="seed of the draws from the pool")
    parser.add_argument("--out", type=Path, metavar="FILE", help="JSON file to write")
    add_force(parser, "replace an existing file")


def run(arguments: argparse.Namespace) -> int:
    require_extra("study")
    from experiments.analysis.planning.power import StudyCost, Wanted, plan_power
    from experiments.analysis.study.measures import read_measures
    from experiments.analysis.study.table import read_study
    from experiments.errors import ConfigError
    from experiments.record.files import write_json
    from experiments.record.run_directory import check_file
    from experiments.trials.design import read_design
    from experiments.trials.designs import study_path

    if arguments.seed < 0:
        raise ConfigError(f"--seed {arguments.seed} must not be negative")
    check_file(arguments.out, replace=arguments.force)
    if arguments.homes is not None:
        return _homes(arguments)
    wanted = Wanted(
        arguments.measure,
        arguments.effect,
        arguments.difference,
        arguments.eta_squared,
        arguments.power,
        arguments.alpha,
    )
    cost = StudyCost(arguments.pay, arguments.fee, arguments.minutes, arguments.dropout)
    cells = [(trial.assistance, trial.objects) for trial in read_design(study_path(arguments.study)).trials]
    pool = read_study(arguments.pool, read_measures())
    found = plan_power(cells, pool, wanted, cost, seed=arguments.seed)
    _show(found, wanted, pool.sources[wanted.measure])
    for line in pool.absent():
        print(line)
    if arguments.out is not None:
        write_json(arguments.out, {**asdict(wanted), **asdict(cost), **asdict(found)})
    return 0


def _homes(arguments: argparse.Namespace) -> int:
    from experiments.analysis.planning.homes_power import draw, homes_power
    from experiments.analysis.study.measures import read_measures
    from experiments.analysis.study.table import read_study
    from experiments.record.files import write_json
    from experiments.record.run_directory import check_file

    check_file(arguments.plot, replace=arguments.force)
    found = homes_power(
        read_study(arguments.pool, read_measures()),
        arguments.measure,
        arguments.homes,
        arguments.people,
        arguments.trials,
        difference=arguments.difference,
        alpha=arguments.alpha,
    )
    print(f"{found.origin}: the people that this is based on.")
    print(f"power to detect the effect of assistance on {found.column}, {found.trials} trials of each person")
    print(f"{'homes':>8}" + "".join(f"{f'{n} people':>12}" for n in found.people))
    for homes, powers in zip(found.homes, found.power, strict=True):
        print(f"{homes:>8}" + "".join(f"{power:>12.3f}" for power in powers))
    if arguments.plot is not None:
        draw(arguments.plot, found, arguments.measure)
    if arguments.out is not None:
        write_json(arguments.out, asdict(found))
    return 0


def _show(plan: Any, wanted: Any, column: str) -> None:
    print(f"{plan.origin}: the people that this is based on.")
    print(f"effect      {wanted.effect} on {column}, partial eta squared {plan.eta_squared:.3f}")
    print(
        f"people      {plan.per_cell}{_range(plan.interval)} in each of {plan.cells} cells, {plan.people} in total"
    )
    print(f"to recruit  {plan.to_recruit}")
    print(f"cost        {plan.cost:.0f}{_range(plan.cost_interval)}")
    print(f"hours       {plan.hours:.0f}{_range(plan.hours_interval)}")
    error = f"{plan.power:.1%} +- {plan.power_error:.1%}"
    print(
        f"power       {error} of studies of this size, drawn from the pool, detect it ({wanted.power:.0%} wanted)"
    )


def _range(interval: tuple[float, float] | None) -> str:
    return "" if interval is None else f" [90 % interval: {interval[0]:.0f} to {interval[1]:.0f}]"
