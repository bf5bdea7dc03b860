"""A live session with a participant. Its journal records each step, so that it can resume after a crash."""

import json
import logging
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from experiments.errors import RecordError, ReplayError
from experiments.house import House
from experiments.participants.base import Percept
from experiments.record.journal import JOURNAL, Header, Journal, JournalEntry, read_entries, sync_folder
from experiments.record.phases import INTERRUPTED
from experiments.record.reader import read_journal, read_run, same_record
from experiments.record.records import TOPDOWN, EventLog
from experiments.record.run_directory import JOURNALS, is_run, run_directory
from experiments.record.verify import checksum_mismatches
from experiments.record.writer import save_record
from experiments.session.familiarise import Familiarisation
from experiments.session.session import Viewer
from experiments.trials.replay.replayer import LogSource
from experiments.trials.setup import (
    draw_person,
    prepare_session,
    regret_evaluator,
    solver_source,
    trial_episode,
    trial_planner,
)
from experiments.trials.trial import draw_floor_plan
from experiments.trials.trial_config import TrialConfig
from experiments.web.controls import Controls, Input, control_step
from hud.texts import HudTexts
from mjsim.house.scene.scene import compose
from mjsim.values.actions import Action
from mjsim.values.options import WorldOptions
from mjsim.world.world import World
from planner.service import Planner

LOG = logging.getLogger("mjsim.play")
MAX_JOURNAL = 512 * 1024**2  # journal size in bytes at which a session ends (after about 7 h with 6 objects)


class InputState(msgspec.Struct):
    """The state of a participant's inputs, which is stored in the journal."""

    controls: Controls = Controls()
    input: int = 0


class BrowserParticipant:
    """A participant in a live session who is controlled by a real person.

    Attributes:
        inputs: Inputs for the next control step.
        seen: Observation before the next control step.
    """

    needs: frozenset[str] = frozenset()

    def __init__(self, world: World) -> None:
        self.state = InputState()
        self.inputs: Sequence[Input] = ()
        self.seen = world.observation()
        self._world = world

    def act(self, percept: Percept) -> Action:  # noqa: ARG002 - a person sees the picture
        world, state = self._world, self.state
        action, state.controls = control_step(
            state.controls,
            self.inputs,
            self.seen,
            world.answer,
            world.scene.person,
            world.control_timestep,
        )
        if self.inputs:
            state.input = self.inputs[-1].number
        self.inputs = ()
        return action


class LiveSession:
    """A live session of a trial. If its journal contains control steps, it continues after the last one.

    Args:
        journal: Journal of all control steps. If it is empty, `config` is written first.
        config: Settings of the trial, or None to use those in the journal.
        before: Fields of the `phase_ended` events of earlier phases.
        texts: HUD texts, or None for the default texts of the language.

    Attributes:
        config: Settings of the trial.
        shown: House with labels in the participant's language.
        resumed: True if another process started the session.

    Raises:
        RecordError: The journal is empty, the session is over, or replaying the journal leads to different states.
    """

    def __init__(
        self,
        journal: Journal,
        house: House,
        config: TrialConfig | None = None,
        viewer: Viewer | None = None,
        *,
        before: Sequence[dict[str, Any]] = (),
        language: str = "en",
        texts: HudTexts | None = None,
    ) -> None:
        self._journal = journal
        config = _config_in(journal) or config
        if config is None or is_over(journal):
            raise RecordError("the journal is empty" if config is None else "this session is over")
        self.config: TrialConfig = config
        person = draw_person(config)
        self.house = house.for_person(person)
        self.shown = self.house.in_language(language, texts)
        self.scene = compose(trial_episode(config, self.house), self.house.catalogue, person=person)
        if not journal.entries:
            journal.append(Header(config.settings(), self.scene.episode.to_json()))
            journal.sync()
        record = read_journal(journal.entries) if len(journal.entries) > 1 else None
        journal.entries = ()  # frees memory, which is about 80 MB per hour of entries
        self.resumed = record is not None
        options = WorldOptions(fidelity=config.fidelity, capacity=config.capacity)
        self.world = World(self.scene, options, walls=self.house.navmesh.outline)
        self._human = BrowserParticipant(self.world)
        if record is None:
            self._planner = trial_planner(config, self.house, self.scene.episode)
        else:
            logged = LogSource(record.plans, lambda: self.session.time)
            evaluator = regret_evaluator(config, self.house)
            self._planner = Planner(logged, evaluator, live=True)
        log = EventLog()
        self.session, _ = prepare_session(
            config,
            self.shown,
            self.scene,
            log,
            viewer,
            self._planner,
            world=self.world,
            user=self._human,
            journal=journal,
        )
        self.session.shows_each_step = False  # the clock decides which states are shown
        Familiarisation(tuple(before), None).log(log)
        if record is None:
            self.session.begin()
            return
        self.session.resume(record)
        self._human.state = msgspec.convert(record.participant, InputState)
        source = solver_source(config, self.house)
        source.adopt(self.session.assistant.task_state(self.world.observation()))
        self._planner.use(source)

    @property
    def input(self) -> int:
        """The number of the last input in effect."""
        return self._human.state.input

    @property
    def end_reason(self) -> str | None:
        """The reason for the end of the task, or None if the task has not ended."""
        return self.session.end_reason or (INTERRUPTED if self._journal.size > MAX_JOURNAL else None)

    def release(self) -> None:
        self._human.state.controls = Controls()

    def step(self, inputs: Sequence[Input]) -> None:
        """Run a control step. It is durable once the journal is synced. Raises PhysicsError or OSError."""
        for new in inputs:
            if new.scroll:
                self.session.scroll(new.scroll)
        self._human.inputs, self._human.seen = inputs, self.session.observation
        self.session.advance()
        self.session.record.commit(self._human.state)

    def end(self, reason: str) -> None:
        """End the session so that `save_run` can write the run directory."""
        self.session.end(reason)
        self.session.record.commit(self._human.state)
        self._journal.sync()
        self.close()

    def close(self) -> None:
        self._planner.close()


def _config_in(journal: Journal) -> TrialConfig | None:
    header = journal.entries[0] if journal.entries else None
    return TrialConfig.of(header.settings) if isinstance(header, Header) else None


def is_over(journal: Journal) -> bool:
    last = journal.entries[-1] if journal.entries else None
    return (
        isinstance(last, JournalEntry) and bool(last.events) and json.loads(last.events[-1])["event"] == "end"
    )


def open_journal(folder: Path) -> Journal:
    """Open the journal in a folder. Create the folder and the journal if they do not exist."""
    folder.mkdir(parents=True, exist_ok=True)
    return Journal(folder / JOURNAL)


def journal_of(run: Path) -> Path | None:
    """Return the folder that contains a run's journal, or None if there is no journal."""
    folders = (run, run.parent / JOURNALS / run.name)
    return next((folder for folder in folders if (folder / JOURNAL).is_file()), None)


def save_run(folder: Path, run: Path, house: House | None = None, *, floor_plan: bool = True) -> None:
    """Write the run directory and the floor plan of a session from its journal, even if it is unfinished.

    Args:
        run: Path of the run directory. Existing parts are kept.
        house: House of the trial, or None to load it.

    Raises:
        RecordError: There is no journal or control step, or the run directory cannot be written.
        ReplayError: The existing run directory cannot be read.
        OSError: The journal cannot be read.
    """
    if is_run(run) and ((run / TOPDOWN).is_file() or not floor_plan):
        return
    record = read_run(run) if is_run(run) else read_journal(read_entries(folder / JOURNAL))
    if not record.steps:
        raise RecordError("nothing was played")
    if not is_run(run):
        with run_directory(run) as work:
            save_record(work, run, record, wall=float(record.trajectory["time"][-1]))
    if floor_plan:
        house = (house or House.load(record.start["house"])).for_person(record.person)
        draw_floor_plan(run, house, record)


def remove_journal(folder: Path, run: Path) -> None:
    """Delete the journal of a finished session if its run directory holds the same record.

    If they differ or cannot be compared, the journal is kept and a warning is logged.
    """
    if not (folder / JOURNAL).is_file():
        return
    try:
        with Journal(folder / JOURNAL) as journal:
            saved = read_run(run)
            faults = [mismatch.message for mismatch in checksum_mismatches(run)]
            if journal.entries and not same_record(saved, read_journal(journal.entries)):
                faults.append("the run directory differs from the journal")
            if faults:
                LOG.warning("%s is kept: %s", folder / JOURNAL, faults[0])
                return
            for path in (*run.iterdir(), run, run.parent):
                sync_folder(path)
            (folder / JOURNAL).unlink()
    except (RecordError, ReplayError, OSError) as error:
        LOG.warning("%s is kept: %s", folder / JOURNAL, error)
        return
    with suppress(OSError):  # raised if the folder contains the journal of another trial
        folder.rmdir()
        folder.parent.rmdir()
