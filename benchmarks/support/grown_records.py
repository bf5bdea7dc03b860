"""Create the records of many trials by copying a few real ones with other seeds, names and checksums."""

import hashlib
import itertools
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.record import records
from experiments.record.files import CHECKSUMS, read_checksums
from experiments.record.run_directory import TRIALS
from experiments.trials.batch import run_batch
from experiments.trials.batch_folder import read_trial, trial_key, trial_name
from experiments.trials.batch_plan import check_trials
from experiments.trials.design import Design, factorial
from experiments.trials.fingerprint import Inputs, fingerprint
from experiments.trials.trial_config import SEEDS, TrialConfig

OPTIONS: dict[str, Any] = {"objects": 1, "fidelity": "event", "regret": False}
CONDITIONS = "none", "optimal"


@dataclass(frozen=True)
class Source:
    """The record of a real trial: the contents of the files that depend on seeds, and all checksums."""

    path: Path
    events: tuple[str, str]  # the line of the start event, and the lines of all other events
    episode: Mapping[str, Any]
    metrics: Mapping[str, Any]
    sums: Mapping[str, str]

    @classmethod
    def read(cls, path: Path) -> "Source":
        start, _, others = (path / records.EVENTS).read_text().partition("\n")
        episode, metrics = (
            json.loads((path / name).read_text()) for name in (records.EPISODE, records.METRICS)
        )
        return cls(path, (start, others), episode, metrics, read_checksums(path))

    def grow(self, trial: TrialConfig, inputs: Inputs, folder: Path) -> None:
        """Write a copy of this record for another trial with other seeds. Large files are linked."""
        changed = {name: getattr(trial, name) for name in SEEDS}
        episode = json.dumps({**self.episode, "seed": trial.house_seed})
        changed["fingerprint"] = fingerprint(trial, inputs)
        start = {
            **json.loads(self.events[0]),
            **changed,
            "inputs": dict(inputs),
            "episode_sha256": _sha256(episode),
        }
        texts = {
            records.EPISODE: episode,
            records.EVENTS: f"{json.dumps(start)}\n{self.events[1]}",
            records.METRICS: json.dumps({**self.metrics, **changed}, indent=2),
        }
        folder.mkdir(parents=True)
        sums = {**self.sums, **{name: _sha256(text) for name, text in texts.items() if name in self.sums}}
        for path in self.path.iterdir():
            if path.name not in (*texts, CHECKSUMS):
                os.link(path, folder / path.name)
        texts[CHECKSUMS] = "".join(f"{sums[name]}  {name}\n" for name in sorted(sums))
        for name, text in texts.items():
            (folder / name).write_text(text)


def design_of(trials: int) -> Design:
    """Return a design with pairs of trials, one without and one with assistance, that share a seed."""
    return factorial(
        assistance=CONDITIONS, users=("follower",), seeds=range(trials // 2), objects=(1,), **_same()
    )


def batch_words(trials: int, out: Path) -> list[str]:
    """Return the command-line arguments that run this design."""
    return [
        *("batch", "--objects", "1", "--fidelity", "event", "--no-regret"),
        *("--assistance", ",".join(CONDITIONS), "--seeds", f"0:{trials // 2}", "--out", str(out)),
    ]


def real_trials(trials: int, out: Path, workers: int) -> dict[str, list[Source]]:
    """Run the real trials that are missing in `out`. Return all real trials by assistance."""
    run_batch(design_of(trials), out, workers=workers)
    found: dict[str, list[Source]] = {}
    for path in sorted((out / TRIALS).iterdir()):
        source = Source.read(path)
        found.setdefault(str(source.metrics["assistance"]), []).append(source)
    return found


def grow_batch(real: Mapping[str, Sequence[Source]], trials: int, out: Path) -> None:
    """Write the folder of a batch in which all trials are finished but the tables are missing.

    Raises:
        RuntimeError: A record does not match the design.
    """
    design = design_of(trials).trials
    inputs = check_trials(design)
    sources = {assistance: itertools.cycle(some) for assistance, some in real.items()}
    for trial, needed in zip(design, inputs, strict=True):
        place = out / TRIALS / trial_name(trial, needed)
        next(sources[trial.assistance]).grow(trial, needed, place)
    stored = read_trial(place)
    if stored.key != trial_key(trial.settings()) or stored.inputs != needed or not stored.as_measured:
        raise RuntimeError(f"{place} is not the record of its trial; is a field of the start event new?")


def grow_visits(real: Mapping[str, Sequence[Source]], places: Iterable[Path]) -> None:
    """Write a record for a different participant to each path."""
    sources = itertools.cycle(source for some in real.values() for source in some)
    for number, place in enumerate(places):
        source = next(sources)
        trial = TrialConfig(seed=number, assistance=source.metrics["assistance"], user="follower", **OPTIONS)
        source.grow(trial, json.loads(source.events[0])["inputs"], place)


def _same() -> dict[str, Any]:
    return {name: value for name, value in OPTIONS.items() if name != "objects"}


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
