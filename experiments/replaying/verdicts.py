"""What a replay says about each file of a run: one line that tells what was checked, or what is wrong."""

from collections.abc import Sequence
from dataclasses import dataclass

from experiments.replaying.comparison import simulated_mismatches
from experiments.replaying.derived_files import checksum_mismatches, derived_mismatches
from experiments.replaying.phases import phase_mismatches
from experiments.replaying.record_checks import Mismatch
from experiments.replaying.replayer import Replayer
from experiments.replaying.run_record import RunRecord
from experiments.runs import records
from experiments.runs.checksums import CHECKSUMS

SIMULATED = (records.EVENTS, records.TRAJECTORY, records.RECORDING)  # by simulating the run again
DERIVED = (records.PLAN, records.METRICS)  # follow from those


@dataclass(frozen=True)
class Verdict:
    """What a replay found out about one file.

    Attributes:
        file: Its name.
        verified: Whether all that it shows was checked and is as recorded.
        text: What was checked, or what is wrong.
    """

    file: str
    verified: bool
    text: str

    def __str__(self) -> str:
        return f"{self.file:<15} {'verified' if self.verified else 'NOT VERIFIED'}: {self.text}"


def all_mismatches(replayer: Replayer) -> list[Mismatch]:
    """Everything in which a finished replay or the files on disk differ from the record.

    The earliest step comes first; that a file has another checksum comes last, as it says the least.
    """
    simulated = (*phase_mismatches(replayer), *simulated_mismatches(replayer))
    found = sorted(simulated, key=lambda mismatch: mismatch.step)
    if not found:
        found += derived_mismatches(replayer.record)
    return [*found, *checksum_mismatches(replayer.record)]


def verdicts(replayer: Replayer, mismatches: Sequence[Mismatch]) -> tuple[Verdict, ...]:
    """One verdict per file of the run that is there or should be.

    Args:
        replayer: A finished replay.
        mismatches: What `all_mismatches` found.
    """
    record = replayer.record
    wrong: dict[str, str] = {}
    for mismatch in mismatches:
        wrong.setdefault(mismatch.file, mismatch.message)
    present = [name for name in records.FILES if (record.directory / name).exists() or name in wrong]
    others = [name for name in wrong if name not in present]
    simulated = not any(name in wrong for name in SIMULATED)
    return tuple(_verdict(replayer, name, wrong.get(name), simulated) for name in (*present, *others))


def _verdict(replayer: Replayer, name: str, wrong: str | None, simulated: bool) -> Verdict:
    if wrong is not None:
        return Verdict(name, False, wrong)
    if name in DERIVED and not simulated:
        return Verdict(name, False, "what it follows from is not as recorded")
    if name in SIMULATED and not simulated:
        end = replayer.first + len(replayer.recording.state_hashes())
        return Verdict(
            name, False, f"nothing wrong was found, but only steps up to {end} were simulated again"
        )
    return Verdict(name, True, _checked(replayer.record, name, replayer.first))


def _checked(record: RunRecord, name: str, first: int) -> str:
    """What was checked of a file without mismatches."""
    start = f" from step {first} on" if first else ""
    plans = sum(event["event"] == "plan" for _, event in record.events)
    return {
        records.EPISODE: "the episode of the log",
        records.EVENTS: f"{len(record.events)} events, simulated again{start}; plans and regrets by hash",
        records.TRAJECTORY: f"{record.steps} steps, simulated again{start}",
        records.RECORDING: f"{record.steps} states and {len(record.recorded.checkpoint_step)} checkpoints{start}",
        records.PLAN: f"the {plans} plans of the log",
        records.METRICS: "every number computed anew; renderer, wall time and hash of the frames by SHA-256",
    }.get(name, f"the file that was written, by its SHA-256 in {CHECKSUMS}")
