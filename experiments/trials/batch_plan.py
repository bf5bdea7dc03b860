"""What a batch has to do: its design compared with what its folder holds."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from experiments.record.archive import discard
from experiments.record.run_directory import TRIALS
from experiments.trials.batch_folder import OUTDATED, StoredTrial, put_aside, trial_key, trial_name
from experiments.trials.design import counted
from experiments.trials.fingerprint import Inputs, changes
from experiments.trials.trial_config import TrialConfig
from experiments.trials.trial_reader import TrialReader

SHOWN = 3  # names or reasons in a line


@dataclass(frozen=True)
class BatchPlan:
    """What is there and what is to be run."""

    done: tuple[StoredTrial, ...]  # trials of the design that the folder holds, as they would come out now
    missing: Mapping[Path, TrialConfig]  # folder and configuration of every other trial of the design
    notes: tuple[str, ...]  # lines that say what is done again, and why


def plan_batch(
    trials: Sequence[TrialConfig],
    inputs: Sequence[Inputs],
    out: Path,
    reader: TrialReader | None = None,
    prefix: str = "",
) -> BatchPlan:
    """Compare a design with what a folder holds, and put aside what is out of date.

    Of the archives, only those whose names begin with `prefix` are changed.
    """
    wanted = dict(zip(trials, inputs, strict=True))
    stored, unusable = (reader or TrialReader(out)).read()
    by_key: dict[str, list[StoredTrial]] = {}
    for found in stored:
        by_key.setdefault(found.key, []).append(found)
    done, missing, reasons = [], {}, Counter[str]()
    outdated, early = set[str](), set[str]()
    for trial, needed in wanted.items():
        same = [s for s in by_key.get(trial_key(trial.settings()), []) if s.is_in(trial.house, needed)]
        current = [s for s in same if s.complete and s.inputs == needed]
        path = out / TRIALS / trial_name(trial, needed)
        for old in same:
            if old not in current:
                reasons.update([_why_again(old, needed)])
                (outdated if old.complete else early).add(old.path.name)
        if current:
            done.append(current[0])
            continue
        if path in unusable:
            reasons.update([unusable[path]])
            outdated.add(path.name)
        missing[path] = trial
    put_aside(out, outdated, prefix)
    discard(out / TRIALS, early, prefix=prefix)
    return BatchPlan(tuple(done), missing, tuple(_notes(reasons, out)))


def _why_again(trial: StoredTrial, inputs: Inputs) -> str:
    if not trial.complete:
        return f"ended early, {trial.row['ended']}"
    return f"{', '.join(changes(trial.inputs, inputs))} changed"


def _notes(reasons: Counter[str], out: Path) -> Iterable[str]:
    if reasons:
        why = "; ".join(f"{reason} ({count})" for reason, count in reasons.most_common(SHOWN))
        yield f"run again: {counted(reasons.total(), 'trial')}: {why}; what was complete is kept in {out / OUTDATED}"
