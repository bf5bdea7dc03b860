"""What a replay reports about each file of a run: one line that tells what was checked, or what is wrong."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from experiments.record import records
from experiments.record.files import CHECKSUMS
from experiments.record.reader import Record
from experiments.record.verify import Mismatch

SIMULATED = (records.EVENTS, records.TRAJECTORY, records.RECORDING)  # by simulating the run again
DERIVED = (records.PLAN, records.METRICS)  # follow from those


@dataclass(frozen=True)
class Verdict:
    """The result of a replay for one file.

    Attributes:
        file: Its name.
        verified: Whether all of it was checked and is as recorded.
        text: What was checked, or what is wrong.
    """

    file: str
    verified: bool
    text: str

    def __str__(self) -> str:
        return f"{self.file:<15} {'verified' if self.verified else 'NOT VERIFIED'}: {self.text}"


def verdicts(
    directory: Path, record: Record, mismatches: Sequence[Mismatch], first: int, end: int
) -> tuple[Verdict, ...]:
    """One verdict per file of the run that exists or should exist.

    Args:
        directory: The run directory.
        record: The record in it.
        mismatches: Everything that was found.
        first: The first control step that was simulated again.
        end: The one after the last.
    """
    wrong: dict[str, str] = {}
    for mismatch in mismatches:
        wrong.setdefault(mismatch.file, mismatch.message)
    present = [name for name in records.FILES if (directory / name).exists() or name in wrong]
    others = [name for name in wrong if name not in present]
    simulated = end > first and not any(name in wrong for name in SIMULATED)

    def verdict(name: str) -> Verdict:
        if name in wrong:
            return Verdict(name, False, wrong[name])
        if name in DERIVED and not simulated:
            return Verdict(name, False, "what it follows from is not as recorded")
        if name in SIMULATED and not simulated:
            steps = f"only steps {first} to {end} were" if end > first else "nothing was"
            return Verdict(name, False, f"no fault was found, but {steps} simulated again")
        return Verdict(name, True, _checked(record, name, first))

    return tuple(verdict(name) for name in (*present, *others))


def _checked(record: Record, name: str, first: int) -> str:
    """What was checked of a file without mismatches."""
    start = f" from step {first} on" if first else ""
    match name:
        case records.EPISODE:
            return "the episode of the log"
        case records.EVENTS:
            return f"{len(record.events)} events, simulated again{start}; plans and regrets by hash"
        case records.TRAJECTORY:
            return f"{record.steps} steps, simulated again{start}"
        case records.RECORDING:
            return f"{record.steps} states and {len(record.checkpoint_steps)} checkpoints{start}"
        case records.PLAN:
            return f"the {len(record.plans)} plans of the log"
        case records.METRICS:
            return "every number computed anew; renderer, wall time and hash of the frames by SHA-256"
    return f"the file that was written, by its SHA-256 in {CHECKSUMS}"
