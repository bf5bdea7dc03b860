"""The run directory of a session with a person, made from its journal alone."""

from collections.abc import Sequence
from pathlib import Path

from experiments.errors import RecordError
from experiments.house import House
from experiments.runs.records import EventLog
from experiments.runs.run_directory import is_run, run_directory
from experiments.trials.setup import draw_person, trial_episode
from experiments.trials.trial_config import TrialConfig
from experiments.trials.trial_record import SessionResult, draw_floor_plan, save_record
from experiments.web.journal import JOURNAL, read_journal
from experiments.web.live_session import config_of
from experiments.web.session_journal import arrays_of, decode, lines_of, recorded_of
from experiments.web.visits import JOURNALS
from mjsim.model.scene import Scene, compose


def save_run(folder: Path, run: Path, house: House | None = None) -> None:
    """Make the run directory where it is not there, and then its floor plan.

    Args:
        folder: Of the journal.
        run: The run directory.
        house: The house of the trial; None to load it.

    Raises:
        RecordError: There is no journal, it holds no control step, or the run directory cannot be made.
        OSError: The journal cannot be read.
    """
    journal = read_journal(folder / JOURNAL)
    house = house or House.load(config_of(decode(journal)[0].config).house)
    _, scene, result = result_of(journal, house)
    if not is_run(run):
        with run_directory(run) as work:
            save_record(work, run, scene, result, float(result.arrays["time"][-1]))
    draw_floor_plan(run, house, scene, result)


def journal_of(run: Path) -> Path | None:
    """Folder of the journal from which a run directory that is not there yet will be made, or None."""
    folders = (run, run.parent / JOURNALS / run.name)
    return next((folder for folder in folders if (folder / JOURNAL).is_file()), None)


def result_of(journal: Sequence[bytes], house: House) -> tuple[TrialConfig, Scene, SessionResult]:
    """What the session of a journal left behind, for its run directory; also that of an unfinished one.

    Raises:
        RecordError: It is no journal of a session, or holds no control step.
    """
    opened, steps, closed = decode(journal)
    if not steps:
        raise RecordError("nothing was played")
    config = config_of(opened.config)
    person = draw_person(config)
    house = house.for_person(person)
    scene = compose(trial_episode(config, house), house.catalogue, person=person)
    tail = closed.log if closed is not None else []
    log = EventLog()
    log.extend(lines_of(steps, tail))
    arrays = arrays_of(scene.episode, steps)
    return config, scene, SessionResult(arrays, recorded_of(steps, arrays, tail), log, None)
