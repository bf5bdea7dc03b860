"""`mjsim import episodes`: the disorder in episodes of others, and episodes of ours with that disorder."""

import argparse
import csv
import importlib.util
import io
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from experiments.cli.options import HelpFormatter, add_setting
from experiments.errors import ConfigError
from mjsim.support.files import write_text_atomically
from mjsim.values.episode import POINTS

if TYPE_CHECKING:
    from mjsim.house.scene.disorder import Disorder
    from mjsim.importing.episodes import EpisodeObject

DESCRIPTION = """\
Read rearrangement episodes of others: RoomR (AI2-THOR rearrangement, .pkl.gz) and Housekeep (.json.gz). Writes
  objects.csv     every object of every episode: whether it is out of place, and how far
  disorder.json   how many objects are out of place, and how far, as --episodes and mjsim.house.scene.disorder take it
  disorder.png    the same as a picture, with the kinds of objects (needs the extra `study`)
With --episodes, also episode_0.json, ... for `mjsim run --episode`: our objects in a house of ours, as many and about
as far from where they belong as in those episodes (docs/import.md)."""


def add_parser(kinds: Any) -> None:
    parser = kinds.add_parser(
        "episodes", help="disorder from episodes", description=DESCRIPTION, formatter_class=HelpFormatter
    )
    parser.set_defaults(run=run)
    add = parser.add_argument
    add("files", type=Path, nargs="+", metavar="FILE", help=".pkl.gz of RoomR, .json.gz of Housekeep")
    add("--out", type=Path, required=True, metavar="DIR", help="folder for what is written, new or not")
    add("--episodes", type=int, default=0, metavar="N", help="episodes to draw in --house (default: 0)")
    add_setting(parser, "house", default="apartment")
    add("--seed", type=int, default=0, metavar="S", help="seed of the first episode; the next ones follow")


def run(arguments: argparse.Namespace) -> int:
    from mjsim.house.scene.disorder import Disorder
    from mjsim.importing.episodes import MISPLACED, kind_of, read_episodes

    if arguments.episodes < 0 or arguments.seed < 0:
        raise ConfigError("--episodes and --seed must not be negative")
    found = [(file, thing) for file in arguments.files for thing in read_episodes(file)]
    things = [thing for _, thing in found]
    misplaced = [thing for thing in things if thing.state == MISPLACED]
    episodes = Counter((file, t.scene, t.episode) for file, t in found)
    wrong = Counter((file, t.scene, t.episode) for file, t in found if t.state == MISPLACED)
    distances = tuple(t.distance for t in misplaced if t.distance is not None)
    disorder = Disorder(tuple(wrong[key] for key in episodes), distances)
    kinds = Counter(kind_of(t.kind) for t in misplaced)
    out: Path = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    write_text_atomically(out / "objects.csv", _table(found))
    write_text_atomically(out / "disorder.json", json.dumps(disorder.tables()) + "\n")
    if importlib.util.find_spec("matplotlib"):
        from experiments.analysis.check_picture import draw_disorder

        draw_disorder(out / "disorder.png", disorder, kinds)
    _print_summary(things, disorder, kinds)
    if arguments.episodes:
        _draw_episodes(arguments, Disorder.load(out / "disorder.json"))
    print(out)
    return 0


def _table(found: Sequence[tuple[Path, "EpisodeObject"]]) -> str:
    text = io.StringIO()
    rows = csv.DictWriter(text, ["file", *(f.name for f in fields(found[0][1]))], lineterminator="\n")
    rows.writeheader()
    rows.writerows({"file": file.name, **asdict(thing)} for file, thing in found)
    return text.getvalue()


def _print_summary(things: Sequence["EpisodeObject"], disorder: "Disorder", kinds: Counter[str]) -> None:
    from mjsim.importing.episodes import IN_PLACE, MISPLACED, OPENED

    states = Counter(thing.state for thing in things)
    count = len(disorder.misplaced)
    print(f"{count} episodes in {len({t.scene for t in things})} scenes, {len(things)} objects")
    spread = ", ".join(
        f"{n} in {100 * k / count:.0f} %" for n, k in sorted(Counter(disorder.misplaced).items())
    )
    print(
        f"out of place: {states[MISPLACED]}, of {states[IN_PLACE] + states[MISPLACED]}; in an episode {spread}"
    )
    if disorder.distances:
        low, quarter, half, more, high = np.quantile(disorder.distances, (0.05, 0.25, 0.5, 0.75, 0.95))
        print(
            f"how far: median {half:.2f} m, half of them {quarter:.2f} to {more:.2f} m, "
            f"nine of ten {low:.2f} to {high:.2f} m"
        )
    if unknown := states[MISPLACED] - len(disorder.distances):
        print(f"without a distance (no right place, or fallen out of the scene): {unknown}")
    if states[OPENED]:
        print(f"open otherwise than wanted: {states[OPENED]}")
    print("most often: " + ", ".join(f"{kind} {n}" for kind, n in kinds.most_common(8)))


def _draw_episodes(arguments: argparse.Namespace, disorder: "Disorder") -> None:
    """Write episodes of our house, and say how near they come."""
    from experiments.house import House

    house = House.load(arguments.house)
    most = house.catalogue.points or POINTS
    reached = []
    for number in range(arguments.episodes):
        seed = arguments.seed + number
        episode = house.sample_episode(objects=disorder.count(seed, most), seed=seed, disorder=disorder)
        episode.save(arguments.out / f"episode_{number}.json")
        for thing in episode.objects:
            home = house.receptacles[episode.targets[thing.name]].center[:2]
            reached.append(float(np.linalg.norm(np.array(thing.point) - home)))
    low, half, high = np.quantile(reached, (0.25, 0.5, 0.75))
    print(
        f"{arguments.episodes} episodes in {house.catalogue.name}: {len(reached)} objects, "
        f"median {half:.2f} m from their bins, half of them {low:.2f} to {high:.2f} m (at least 1 m)"
    )
