"""Hostile cases of all commands: what is done to files, options and places, and what must become of it."""

import argparse
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np

from hostile.code import code_case, environment_case
from hostile.files import (
    Rng,
    damage_file,
    damage_table,
    damage_text,
    damage_toml,
    damage_values,
    is_problem,
    pick,
    rows_of,
)
from hostile.good_files import FAST, MESHES, PROBLEM, made_up_rows, prepare
from hostile.warm_commands import CLOSED, PIPE, REFUSED, USED, Case, CaseFactory

ODD = """
nan inf -1 0 1e308 -0.0 -- - ١٢ 0x10 1_000 1,2 a:b None [] ../.. / /dev/full /dev/zero /dev/null keep.txt keep
no/such/folder/x ünïcode problem.json episode.json run batch %s {} $HOME
"""
ODD_VALUES = (*ODD.split(), "", " ", "9" * 400, "x" * 5000, "a\udcffb", "a\nb")
MANY, SMALL = ("--workers", "--count", "--sessions"), ("0", "-1", "nan", "x", "", "1e3")  # processes
# Words with which each command ends within a second, or which it must refuse; heavy commands are given bad words only.
BASES = {
    "run": f"run --objects 1 --time-limit 1 --out out {' '.join(FAST)}",
    "batch": "batch design.toml --workers 1 --out out",
    "replay": "replay run",
    "metrics": "metrics run",
    "compare": "compare batch",
    "plan": "plan problem.json",
    "house": "house --objects 2 --out out.xml",
    "check": "check episode.json",
    "flythrough": "flythrough --out out.mp4 --seconds 1 --size 320x240",
    "import object": "import object box.stl --category toys --out out",
    "view": "view run --out out.html",
    "study init": "study init out.toml",
    "study serve": "study serve study.toml --port 0 --no-open --out out",
    "study collect": "study collect study.toml served --out out",
    "study pay": "study pay study.toml served",
    "study backup": "study backup study.toml served --out out.db",
    "study restore": "study restore backup.db out.db",
    "study erase": "study erase study.toml served p00001 --who me",
    "study analyze": "study analyze people --out out",
    "study score": "study score people --out out",
    "study power": "study power design.toml --pool people",
    "study preregister": "study preregister design.toml --out out.zip",
    "study simulate": "study simulate design.toml --workers 1 --people 1 --out out",
    "study controls": "study controls nope.toml --out keep.txt",
    "study calibrate": "study calibrate nope.toml --out keep.txt",
    "play": "play --port 0 --no-open --out out",
    "completion": "completion bash",
    "doctor": "doctor",
    "gallery": "gallery nope --out keep.txt",
    "bench": "bench nope",
}
READ = {  # a line that reads each file
    "problem.json": BASES["plan"],
    "episode.json": BASES["check"],
    "design.toml": BASES["study preregister"],
    "study power": BASES["study power"],
    "study.toml": BASES["study serve"],
    "backup.db": BASES["study restore"],
    "person.toml": BASES["run"] + " --person person.toml",
    "box.stl": BASES["import object"],
    "rules.toml": BASES["study analyze"] + " --exclude rules.toml",
    "people/trials.parquet": BASES["study analyze"],
}
TARGETS = {  # what is written where something lies that must stay
    "run": (
        f"run --objects 1 --time-limit 1 {' '.join(FAST)} --out",
        ("keep.txt", "keep", "keep.txt/x", "batch"),
    ),
    "house": ("house --objects 2 --out", ("keep.xml", "keep.txt", "keep.txt/x.xml", "keep")),
    "plan": ("plan problem.json --certificate", ("keep.txt", "keep", "keep.txt/x.json", "/dev/full")),
    "metrics": ("metrics run --out", ("keep.csv", "keep.json", "keep", "keep.txt/x.csv", "keep.txt")),
    "compare": ("compare batch --csv", ("keep.csv", "keep", "keep.txt/x.csv", "/dev/full")),
    "study analyze": ("study analyze people --out", ("keep.txt", "keep.txt/x")),
    "study preregister": ("study preregister design.toml --out", ("keep.txt", "keep", "keep.txt/x")),
    "study collect": ("study collect study.toml served --out", ("keep.txt", "keep.txt/x")),
    "study backup": ("study backup study.toml served --out", ("keep.txt", "keep", "keep.txt/x")),
    "study init": ("study init", ("keep.txt", "keep", "keep.txt/x")),
    "study power": ("study power design.toml --pool people --out", ("keep.txt", "keep")),
    "batch": ("batch design.toml --workers 1 --out", ("keep.txt", "keep", "keep.txt/x")),
    "import object": ("import object box.stl --category toys --out", ("keep.txt", "keep.txt/x")),
    "replay": ("replay run --size 320x240 --video", ("keep.mp4", "keep.txt", "keep.txt/x.mp4")),
    "flythrough": ("flythrough --seconds 1 --size 320x240 --out", ("keep.mp4", "keep.txt", "keep.txt/x.mp4")),
}


def case_factory() -> CaseFactory:
    """Cases of all commands."""
    return CaseFactory(prepare, make_case)


def make_case(number: int, folder: Path) -> Case:
    """The case of a number, whose files are damaged in a folder."""
    rng = np.random.default_rng(number)
    kinds, weights = zip(*KINDS.items(), strict=True)
    chosen = kinds[int(rng.choice(len(kinds), p=np.array(weights) / sum(weights)))]
    return cast(Case, chosen(folder, rng))


def _plan(folder: Path, rng: Rng) -> Case:
    path, piped = folder / "problem.json", rng.uniform() < 0.3
    if rng.uniform() < 0.5:
        kind, text, must = damage_values(json.loads(json.dumps(PROBLEM)), rng)
        path.write_text(text)
        if kind == "other number" and not is_problem(json.loads(text)):
            must = REFUSED
    else:
        kind, must = damage_text(path, rng)
    extra = pick([[], ["--planner", "greedy"], ["--planner", "ortools"], ["--time-limit", "0.5"]], rng)
    if piped:
        return Case("plan", f"standard input: {kind}", ["plan", "-", *extra], must, stdin=path.read_bytes())
    return Case("plan", f"problem: {kind}", ["plan", "problem.json", *extra], must)


def _claim(folder: Path, rng: Rng) -> Case:
    kind, text, must = damage_values(json.loads((folder / "claim.json").read_text()), rng)
    if rng.uniform() < 0.5:
        (folder / "claim.json").write_text(text)
    else:
        kind, must = damage_text(folder / "claim.json", rng)
    return Case("plan", f"certificate: {kind}", ["plan", "problem.json", "--check", "claim.json"], must)


def _episode(folder: Path, rng: Rng) -> Case:
    path = folder / "episode.json"
    if rng.uniform() < 0.6:
        kind, text, must = damage_values(json.loads(path.read_text()), rng)
        path.write_text(text)
    else:
        kind, must = damage_text(path, rng)
    if rng.uniform() < 0.5:
        return Case("check", f"episode: {kind}", ["check", "episode.json"], must)
    words = [
        "run",
        "--episode",
        "episode.json",
        "--time-limit",
        "2",
        "--out",
        "out",
        *FAST,
        "--fidelity",
        _tier(rng),
    ]
    return Case("run", f"episode: {kind}", words, must)


def _tier(rng: Rng) -> str:
    return str(pick(["event", "full"], rng))


HOME = "--house home/catalogue.toml --objects 2 --points 5"


def _home(folder: Path, rng: Rng) -> Case:
    path = pick(sorted((folder / "home").iterdir()), rng)
    kind, must = damage_text(path, rng)
    lines = {
        "check": "check home/catalogue.toml",
        "run": f"run {HOME} --time-limit 2 --out out {' '.join(FAST)} --fidelity {_tier(rng)}",
        "house": f"house {HOME} --out out.xml",
        "check object": f"check home/{path.name}",
    }
    command = pick(lines, rng)
    return Case(command, f"{path.suffix[1:]} of a house: {kind}", lines[command].split(), must)


def _toml(folder: Path, rng: Rng) -> Case:
    names = {
        "study preregister": "design.toml",
        "study power": "design.toml",
        "study analyze": "rules.toml",
        "study serve": "study.toml",
        "run": "person.toml",
    }
    command = pick(names, rng)
    path = folder / names[command]
    if rng.uniform() < 0.6:
        kind, text, must = damage_toml(path.read_text(), rng)
        path.write_text(text)
    else:
        kind, must = damage_text(path, rng)
    return Case(
        command,
        f"{path.name}: {kind}",
        READ[path.name if command != "study power" else command].split(),
        must,
    )


def _table(folder: Path, rng: Rng) -> Case:
    kind, must = damage_table(made_up_rows(), folder / "people" / "trials.parquet", rng)
    command = pick(["study analyze", "study score", "study power"], rng)
    words = BASES[command].split()
    if command == "study power" and kind.startswith("impossible likert"):
        must = ""
    return Case(command, f"table: {kind}", words, must)


def _run_folder(folder: Path, rng: Rng) -> Case:
    command = pick(["replay", "metrics", "metrics batch", "compare", "study analyze"], rng)
    where = folder / ("run" if command in ("replay", "metrics") else "batch")
    path = pick(sorted(p for p in where.rglob("*") if p.is_file()), rng)
    must = REFUSED if command == "replay" else ""
    if rng.uniform() < 0.2:
        path.unlink()
        kind = "file missing"
        must = must if path.name != "SHA256SUMS" else ""
    else:
        before, rows = path.read_bytes(), rows_of(path)
        kind = damage_file(path, rng)
        must = must if path.read_bytes().strip() != before.strip() else ""
        if command in ("compare", "study analyze") and rows_of(path) != rows:
            must = REFUSED
    line = {"metrics batch": command, "study analyze": "study analyze batch --out out"}.get(
        command, BASES.get(command, "")
    )
    return Case(command, f"{path.name}: {kind}", line.split(), must)


def _archive(folder: Path, rng: Rng) -> Case:
    kind = damage_file(folder / "frozen.zip", rng)
    line = BASES["study analyze"] + " --preregistration frozen.zip"
    return Case("study analyze", f"preregistration: {kind}", line.split())


def _mesh(folder: Path, rng: Rng) -> Case:
    name = pick(MESHES, rng)
    if name == "box.obj" and rng.uniform() < 0.6:
        kind, _ = damage_text(folder / name, rng)
    else:
        kind = damage_file(folder / name, rng)
    words = ["import", "object", name, "--category", "toys", "--out", "out"]
    return Case("import object", f"{name[4:]}: {kind}", words)


def _option(folder: Path, rng: Rng) -> Case:  # noqa: ARG001 - nothing is damaged
    """An odd value of any option of a command."""
    command = pick([name for name in BASES if name != "doctor"], rng)  # which has no options
    words = BASES[command].split()
    option = pick(_options(tuple(command.split())), rng)
    name = option.option_strings[-1] if option.option_strings else ""
    value = pick(SMALL if name in MANY else ODD_VALUES, rng)
    given = [name, value] if name and option.nargs != 0 else [name or value]
    heavy = set(words) & {"keep.txt", "nope"}
    must = REFUSED if heavy and name != "--version" else ""
    changes = "served" if command == "study erase" else ""
    stdin = b"" if value != "-" else PIPE
    return Case(command, f"option {option.dest}", [*words, *given], must, stdin=stdin, changes=changes)


def _options(command: tuple[str, ...]) -> list[argparse.Action]:
    from experiments.cli.main import parser

    found: Any = parser(command[0])
    for word in command:
        subs = next(a for a in found._actions if isinstance(a, argparse._SubParsersAction))
        found = subs.choices[word]
    return [action for action in found._actions if action.dest != "help"]


def _target(folder: Path, rng: Rng) -> Case:  # noqa: ARG001
    command = pick(TARGETS, rng)
    line, places = TARGETS[command]
    return Case(command, "a place that is taken", [*line.split(), pick(places, rng)], REFUSED)


def _make_huge(path: Path) -> None:
    path.touch()
    os.truncate(path, 1 << 40)  # a hole


def _input(folder: Path, rng: Rng) -> Case:
    """Standard input that is closed or never ends; files that are none."""
    name = pick([name for name in READ if "." in name], rng)
    line = READ[name]
    command = " ".join(word for word in line.split()[:2] if word.isalpha())
    if rng.uniform() < 0.3:
        return Case("plan", "standard input", ["plan", "-"], REFUSED, stdin=pick([PIPE, CLOSED], rng))
    makers: dict[str, Callable[[Path], None]] = {
        "a pipe": os.mkfifo,
        "a device": lambda path: path.symlink_to("/dev/zero"),
        "a huge file": _make_huge,
        "a folder": Path.mkdir,
        "a circle of links": lambda path: path.symlink_to(path),
        "nothing": lambda _: None,
    }
    kind = pick(makers, rng)
    (folder / name).unlink()
    makers[kind](folder / name)
    return Case(command, f"{name} is {kind}", line.split(), REFUSED)


def _good(folder: Path, rng: Rng) -> Case:  # noqa: ARG001
    """Undamaged files are used: refusals mean something."""
    command = pick([name for name, line in BASES.items() if "nope" not in line], rng)
    must = USED if command not in ("play", "study score", "study power") else ""
    return Case(command, "nothing", BASES[command].split(), must)


# What is tried, and how often.
KINDS: dict[Callable[[Path, Rng], Case], float] = {
    _plan: 14,
    _claim: 6,
    _episode: 10,
    _home: 14,
    _toml: 12,
    _table: 10,
    _run_folder: 12,
    _archive: 2,
    _mesh: 5,
    _option: 16,
    _target: 4,
    _input: 3,
    _good: 1,
    code_case: 12,
    environment_case: 4,
}
