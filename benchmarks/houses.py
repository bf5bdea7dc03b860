"""Measure the quality, cost and variety of many generated homes, and run trials in them.

The part `trials` runs one trial per home with a short person and one with a tall person.
"""

import itertools
import json
import multiprocessing
import statistics
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from rich.console import Console
from rich.progress import track

from benchmarks.support.home_figures import WAY, figures, remade
from benchmarks.support.home_trials import trial_lines, trials
from benchmarks.support.requirements import outcome
from experiments.errors import ConfigError
from mjsim.generator.furniture.catalogue import KINDS
from mjsim.house.catalogue.generated_names import ROOMS
from mjsim.support.files import ROOT, digest_of

T = TypeVar("T")
Rows = Sequence[dict[str, Any]]
PARTS = ("figures", "trials")
COUNT, QUICK = 100, 2  # number of homes of each size
FIRST_SEED = 50_000
OUT = Path("runs/bench-houses")
AGAIN = 10  # every tenth home is generated again in another process
FURNISHED = (0.25, 0.45)  # smallest and largest permitted share of the floor that furniture covers
FAULTS = (
    "failure",
    "errors",
    "warnings",
    "empty",
    "unusable",
    "pockets",
    "windows_behind",
    "lacking",
    "areas_off",
    "overlaps",
    "flicker",
    "no_view",
    "few_places",
)
# Kinds that are groups of other kinds, so that no piece in a home has their names
GROUPS = {"lounge", "dining", "wash_corner", "corner_kitchen"}


def _count(key: str) -> Callable[[Rows], float]:
    return lambda rows: sum(len(row[key]) for row in rows)


def _homes(key: str) -> Callable[[Rows], float]:
    return lambda rows: sum(bool(row[key]) for row in rows)


def _of(key: str, summary: Callable[[Sequence[Any]], float]) -> Callable[[Rows], float]:
    return lambda rows: summary([row[key] for row in rows if row[key] is not None] or [0.0])


def _different(key: str) -> Callable[[Rows], float]:
    return lambda rows: len({json.dumps(row[key]) for row in rows})


def _percentile(values: Sequence[float]) -> float:
    return float(np.percentile(values, 99))


def _overlap(key: str) -> Callable[[Rows], float]:
    """Return the mean share of furniture that two homes have in common, over all pairs of homes."""

    def mean(rows: Rows) -> float:
        bags: list[Counter[str]] = [Counter(row[key]) for row in rows]
        shares = [(a & b).total() / (a | b).total() for a, b in itertools.combinations(bags, 2)]
        return statistics.fmean(shares) if shares else 0.0

    return mean


def _unique_armchairs(rows: Rows) -> float:
    looks = Counter(form for row in rows for form in row["armchairs"])
    return 100 * sum(count == 1 for count in looks.values()) / max(1, looks.total())


def _small(rows: Rows) -> Rows:
    return [row for row in rows if row["rooms"] <= 8]


def _by_size(rows: Rows) -> dict[int, Rows]:
    return {
        size: [row for row in rows if row["rooms"] == size] for size in sorted({row["rooms"] for row in rows})
    }


COLUMNS: Mapping[str, Callable[[Rows], float]] = {  # columns of the table
    "homes": len,
    "m2": _of("area", statistics.median),
    "made in s": _of("make_s", statistics.median),
    "99 %": _of("make_s", _percentile),
    "checked, most s": _of("check_s", max),
    "furnished": _of("share", statistics.median),
    "least": _of("share", min),
    "doorway m": _of("doorway", min),
    "way m": _of("way", min),
    "draws": _of("draws", max),
    "places": _of("places", statistics.median),
    "least places": _of("places", min),
    "door graphs": _different("door_graph"),
    "overlap": _overlap("specimens"),
    "by kind alone": _overlap("kinds"),
}
REQUIREMENTS: Mapping[str, tuple[Callable[[Rows], float], str, float]] = {
    "homes with errors of mjsim check": (_homes("errors"), "<=", 0),
    "homes with warnings, %": (lambda rows: 100 * _homes("warnings")(rows) / len(rows), "<=", 1),
    "plan and furniture up to 8 rooms, median CPU s": (
        lambda rows: COLUMNS["made in s"](_small(rows)),
        "<=",
        1,
    ),
    "the same, 99 %": (lambda rows: COLUMNS["99 %"](_small(rows)), "<=", 5),
    "the same of any size, most": (_of("make_s", max), "<=", 20),
    "check, most CPU s": (_of("check_s", max), "<=", 2),
    "narrowest doorway, clear, m": (
        lambda rows: COLUMNS["doorway m"]([r for r in rows if r["rooms"] > 1]),
        ">=",
        0.85,
    ),
    "narrowest way into a room, m": (_of("way", min), ">=", WAY),
    "pieces that are not reachable by ways of 0.70 m": (_count("unusable"), "<=", 0),
    "places that large people cannot reach": (lambda rows: sum(row["pockets"] for row in rows), "<=", 0),
    "windows behind something higher than the sill": (_count("windows_behind"), "<=", 0),
    "homes that lack something required": (_homes("lacking"), "<=", 0),
    "least share of the floor that is furnished": (_of("share", min), ">=", FURNISHED[0]),
    "most": (_of("share", max), "<=", FURNISHED[1]),
    "rooms with nothing": (_count("empty"), "<=", 0),
    "rooms with an area out of its range, %": (
        lambda rows: 100 * _count("areas_off")(rows) / sum(row["rooms"] for row in rows),
        "<=",
        5,
    ),
    "different door graphs, by use of rooms": (_different("door_graph"), ">=", 300),
    "kinds of furniture": (lambda rows: len({kind for row in rows for kind in row["kinds"]}), ">=", 60),
    "kinds of furniture that are never placed": (
        lambda rows: len(set(KINDS) - GROUPS - {kind for row in rows for kind in row["kinds"]}),
        "<=",
        0,
    ),
    "deepest overlap of drawn furniture, mm": (_of("overlap_mm", max), "<=", 4),
    "homes with faces that flicker": (_homes("flicker"), "<=", 0),
    "living rooms without seats that face a television or stove": (_count("no_view"), "<=", 0),
    "homes of four rooms or more with fewer than 24 places for objects": (_homes("few_places"), "<=", 0),
    "mean overlap of furniture in homes of one size": (
        lambda rows: statistics.fmean(COLUMNS["overlap"](mine) for mine in _by_size(rows).values()),
        "<=",
        0.35,
    ),
    "palettes, in steps of 0.2 of a colour": (_different("palette"), ">=", 30),
    "armchairs that look as no other one, %": (_unique_armchairs, ">=", 50),
    "draw calls of a home without objects, most": (_of("draws", max), "<=", 80),
}


def measure(
    parts: Sequence[str] = PARTS[:1],
    quick: bool = False,
    count: int | None = None,
    rooms: Sequence[int] = range(ROOMS[0], ROOMS[1] + 1),
    first_seed: int = FIRST_SEED,
    workers: int = 1,
    out: Path = OUT,
) -> dict[str, Any]:
    """Run parts of the benchmark and return a JSON-serializable result.

    Args:
        parts: `figures` of the homes, `trials` in them, or both.
        quick: True to generate only two homes of each size.
        count: Number of homes of each size.
        rooms: Numbers of rooms of the homes.
        first_seed: Seed of the first home. The next homes have consecutive seeds.
        workers: Number of processes.
        out: Cache folder for the figures of every home. A changed generator invalidates them.

    Raises:
        ConfigError: There is no such part.
    """
    if unknown := sorted(set(parts) - set(PARTS)):
        raise ConfigError(f"benchmark houses has no parts {', '.join(unknown)}; there are {', '.join(PARTS)}")
    each = count or (QUICK if quick else COUNT)
    homes = [(size, first_seed + each * (size - ROOMS[0]) + i) for i in range(each) for size in rooms]
    result = _figures(homes, workers, out) if "figures" in parts else {}
    if "trials" in parts:
        result["trials"] = [row for rows in _in_workers(trials, homes, workers, "trials") for row in rows]
    return result


def _figures(homes: Sequence[tuple[int, int]], workers: int, out: Path) -> dict[str, Any]:
    code = digest_of(*(ROOT / "mjsim" / name for name in ("generator", "house", "formats/gltf")))
    rows = {(row["rooms"], row["seed"]): row for row in _kept(out) if row["code"] == code}
    missing = [home for home in homes if home not in rows]
    out.mkdir(parents=True, exist_ok=True)
    with (out / "homes.jsonl").open("a", encoding="utf-8") as file:
        for row in _in_workers(figures, missing, workers, "homes"):
            rows[row["rooms"], row["seed"]] = row | {"code": code}
            file.write(json.dumps(rows[row["rooms"], row["seed"]]) + "\n")
            file.flush()
    found = [rows[home] for home in homes]
    built = [row for row in found if "failure" not in row]
    again = [(row["rooms"], row["seed"]) for row in built[::-AGAIN]]
    others = sum(
        rows[home]["digest"] != same
        for home, same in zip(again, _in_workers(remade, again, workers, "again"), strict=True)
    )
    return {
        "homes": len(found),
        "failed": len(found) - len(built),
        "other_bytes": others,
        "sizes": {
            size: {name: figure(mine) for name, figure in COLUMNS.items()}
            for size, mine in _by_size(built).items()
        },
        "figures": {name: figure(built) for name, (figure, *_) in REQUIREMENTS.items()},
        "faults": [
            f"generated:{row['seed']}?rooms={row['rooms']}: {key.replace('_', ' ')}: {row[key]}"
            for row in found
            for key in FAULTS
            if row.get(key)
        ],
    }


def _kept(out: Path) -> Iterator[dict[str, Any]]:
    path = out / "homes.jsonl"
    if path.is_file():
        for line in path.read_text(encoding="utf-8").splitlines():
            if line.endswith("}"):  # an interrupted run may have left a truncated last line
                yield json.loads(line)


def _in_workers(
    run: Callable[[tuple[int, int]], T], homes: Sequence[tuple[int, int]], workers: int, what: str
) -> Iterator[T]:
    """Call `run` for every home in new processes, which first compile their kernels with an extra home."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, context, initializer=figures, initargs=((ROOMS[0], 0),)) as pool:
        yield from track(pool.map(run, homes), what, total=len(homes), console=Console(stderr=True))


def lines(result: dict[str, Any]) -> Iterator[str]:
    if "figures" in result:
        yield from _figure_lines(result)
    if "trials" in result:
        yield from trial_lines(result["trials"])


def _figure_lines(result: dict[str, Any]) -> Iterator[str]:
    yield from result["faults"]
    yield "| rooms | " + " | ".join(COLUMNS) + " |"
    yield "|---" * (len(COLUMNS) + 1) + "|"
    for size, row in result["sizes"].items():
        yield f"| {size} | " + " | ".join(f"{cell:.3g}" for cell in row.values()) + " |"
    own = {f"not built, of {result['homes']}": "failed", "made again with other bytes": "other_bytes"}
    for name, key in own.items():
        yield _judged(name, result[key], "<=", 0)
    for name, (_, relation, bound) in REQUIREMENTS.items():
        yield _judged(name, result["figures"][name], relation, bound)


def _judged(name: str, value: float, relation: str, bound: float) -> str:
    return f"{name}: {value:.4g} ({relation} {bound:g}: {outcome(value, relation, bound)})"
