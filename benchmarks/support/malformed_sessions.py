"""What becomes of damaged houses: used, or refused in one line; tried in a process that may crash or hang."""

import multiprocessing
import tempfile
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from benchmarks.support.example_house import write_example_house
from benchmarks.support.malformed_files import damage
from experiments.failures import exit_code
from experiments.house import House
from mjsim.actions import Move
from mjsim.episode import Episode
from mjsim.errors import PhysicsError
from mjsim.model.catalogue import Catalogue
from mjsim.model.sampling import sample_episode
from mjsim.model.scene import compose
from mjsim.world import World

LIMIT = 60.0  # s for one case; starting a process is not counted
STEPS = 10
MAX_MESSAGE = 2000  # characters
USED, REFUSED = "used", "refused"
EPISODE = "episode.json"


@dataclass(frozen=True)
class Outcome:
    """What became of one damaged house.

    Attributes:
        seed: Of the damage.
        damage: What was done to which file; empty where the process died before it could say.
        result: `used`, `refused`, or what went wrong.
        message: The error's message, or the traceback of one that should not have come.
    """

    seed: int
    damage: str
    result: str
    message: str = ""

    @property
    def good(self) -> bool:
        """Whether it was used or refused as it should be."""
        return self.result in (USED, REFUSED)


def run_cases(seeds: Sequence[int], limit: float = LIMIT) -> Iterator[Outcome]:
    """Try the damage of each seed; a process that crashes or takes longer than `limit` s is replaced."""
    context = multiprocessing.get_context("spawn")
    left = list(seeds)
    while left:
        ours, theirs = context.Pipe()
        process = context.Process(target=_work, args=(theirs, tuple(left)), daemon=True)
        process.start()
        theirs.close()
        ours.recv()  # it has started
        for seed in tuple(left):
            result = _next(ours, process, limit)
            left.remove(seed)
            yield result if isinstance(result, Outcome) else Outcome(seed, "", result)
            if not isinstance(result, Outcome):
                break
        process.kill()
        process.join()


def _next(
    connection: Connection, process: multiprocessing.process.BaseProcess, limit: float
) -> Outcome | str:
    if not connection.poll(limit):
        return f"hung for {limit:g} s"
    try:
        outcome: Outcome = connection.recv()
    except EOFError:
        process.join()
        return f"crashed with exit code {process.exitcode}"
    return outcome


def _work(connection: Connection, seeds: Sequence[int]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        write_example_house(Path(folder))
        catalogue = Catalogue.load(f"{folder}/catalogue.toml")
        episode = sample_episode(catalogue, objects=3, seed=0, points=5).to_json()
    connection.send(None)
    for seed in seeds:
        with tempfile.TemporaryDirectory() as folder:
            connection.send(
                _try(seed, Path(folder), episode.replace(catalogue.name, f"{folder}/catalogue.toml"))
            )


def _try(seed: int, folder: Path, episode: str) -> Outcome:
    catalogue = write_example_house(folder)
    (folder / EPISODE).write_text(episode, encoding="utf-8")
    done = damage(folder, np.random.default_rng(seed))
    try:
        _use(catalogue, folder / EPISODE if EPISODE in done else None)
    except Exception as error:
        said = str(error)
        if exit_code(error) is None:
            return Outcome(seed, done, f"raised {type(error).__name__}", traceback.format_exc())
        if "\n" in said or not 10 <= len(said) <= MAX_MESSAGE:
            return Outcome(seed, done, "refused in more or less than a line", said)
        return Outcome(seed, done, REFUSED, said)
    return Outcome(seed, done, USED)


def _use(catalogue: Path, episode_file: Path | None) -> None:
    """Load, sample or read an episode, and walk a few steps."""
    house = House.load(str(catalogue))
    if episode_file is not None:
        episode = Episode.load(episode_file)
    else:
        episode = house.sample_episode(objects=3, seed=0, points=5)
    world = World(compose(episode, house.catalogue))
    try:
        for _ in range(STEPS):
            seen = world.step(Move(forward=1.0, turn=0.5)).observation
    except PhysicsError as error:
        raise RuntimeError(f"accepted, and then: {error}") from error
    if not (np.isfinite(seen.position).all() and np.isfinite(seen.object_positions).all()):
        raise RuntimeError("accepted, and then positions were not finite")
