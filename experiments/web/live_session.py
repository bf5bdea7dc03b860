"""A session with a person: stepped from outside, journalled step by step, and able to go on after a crash."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from experiments.errors import RecordError
from experiments.familiarisation.familiarise import Familiarisation
from experiments.house import House
from experiments.participants.base import Decision, Percept
from experiments.participants.behaviour import BehaviourDistribution
from experiments.replaying.logged_replanner import LoggedReplanner
from experiments.replaying.replayer import catch_up
from experiments.runs.recording import Recording
from experiments.runs.records import EventLog
from experiments.runs.trajectory import Trajectory
from experiments.session.viewer import Viewer
from experiments.trials.person_distribution import PersonDistribution
from experiments.trials.setup import draw_person, prepare_session, trial_episode
from experiments.trials.trial_config import TrialConfig
from experiments.web.controls import Controls, Input, control_step
from experiments.web.journal import JOURNAL, Journal
from experiments.web.resuming_planner import ResumingPlanner
from experiments.web.session_journal import (
    Checkpoint,
    Closed,
    Opened,
    Step,
    arrays_of,
    decode,
    encode,
    lines_of,
    record_of,
)
from mjsim.actions import Action
from mjsim.model.scene import compose
from mjsim.options import WorldOptions
from mjsim.world import World
from planner.live import LiveReplanner
from planner.solver import solver

ROWS = 1000  # of the trajectory that are kept in memory


class Human:
    """The participant of a session with a person.

    Args:
        world: The world in which it acts.

    Attributes:
        controls: What is held down and where the mouse points.
        inputs: What came since the last control step; the next one takes it.
        recorded: Actions of an earlier process to do first, the next one last.
    """

    needs: frozenset[str] = frozenset()

    def __init__(self, world: World) -> None:
        self.controls = Controls()
        self.inputs: Sequence[Input] = ()
        self.recorded: list[Action] = []
        self._world = world

    def act(self, percept: Percept) -> Decision:  # noqa: ARG002 - a person sees the frame
        """What was pressed."""
        if self.recorded:
            return self.recorded.pop()
        world = self._world
        seen, person = world.observation(), world.scene.person
        action, self.controls = control_step(
            self.controls, self.inputs, seen, world.answer, person, world.control_timestep
        )
        self.inputs = ()
        return action


class LiveSession:
    """A session of the trial that a journal is about, from its last control step on.

    Args:
        journal: Takes every control step. An empty one begins with `config`.
        house: The house of the trial.
        config: The trial; None to go on with the one in the journal.
        viewer: Sees every control step.
        before: The phases before this one, as `phase_ended` events say of them.

    Attributes:
        config: The trial.
        world: The world.
        session: The session.
        resumed: Whether an earlier process had begun it.
        input: Number of the last input that counted.

    Raises:
        RecordError: The journal is no journal of a session, or does not lead to the state that it holds.
    """

    def __init__(
        self,
        journal: Journal,
        house: House,
        config: TrialConfig | None = None,
        viewer: Viewer | None = None,
        *,
        before: Sequence[dict[str, Any]] = (),
    ) -> None:
        self._journal = journal
        self.config, steps = _begun(journal, config)
        self.resumed = bool(steps)
        config, person = self.config, draw_person(self.config)
        self.house = house.for_person(person)
        self.scene = compose(trial_episode(config, self.house), self.house.catalogue, person=person)
        if not journal.records:
            journal.append(encode(Opened(config.settings(), self.scene.episode.to_json())))
            journal.sync()
        self._log = EventLog()  # without what the journal has
        self._log.muted = self.resumed
        self.world = World(self.scene, WorldOptions(fidelity=config.fidelity, capacity=config.capacity))
        self._human = Human(self.world)
        self._planner = self._planner_after(steps)
        self.session, _ = prepare_session(
            config,
            self.house,
            self.scene,
            self._log,
            viewer,
            self._planner,
            world=self.world,
            user=self._human,
        )
        Familiarisation(tuple(before), None).log(self._log)
        self.input = 0
        if steps:
            self._resume(steps)
        else:
            observation = self.world.reset()
            self.session.assistant.begin(observation)
            self.session.start(observation)
        journal.records = ()  # those of an hour take some 80 MB

    @property
    def end_reason(self) -> str | None:
        """Why the task is over; None while it goes on."""
        return self.session.end_reason

    def step(self, inputs: Sequence[Input]) -> None:
        """One control step; it is safe once the journal was synced.

        Raises:
            PhysicsError: The physics failed.
            OSError: The journal cannot be written.
        """
        for new in inputs:
            if new.scroll:
                self.session.scroll(new.scroll)
        self._human.inputs = inputs
        lines, number = self._log.take_lines(), self.session.recording.step
        self.session.advance()
        self.input = (
            inputs[-1].number if inputs else self.input
        )  # only now: the step began by showing the state before it
        self._append_step(lines, number)

    def end(self, reason: str) -> None:
        """End the session; the run directory can then be made from the journal.

        Raises:
            OSError: The journal cannot be written.
        """
        lines, number = self._log.take_lines(), self.session.recording.step
        self.session.end(reason)
        if self.session.recording.step > number:
            self._append_step(lines, number)
            lines = []
        self._journal.append(encode(Closed([*lines, *self._log.take_lines()])))
        self._journal.sync()
        self.close()

    def close(self) -> None:
        """Stop planning in the background."""
        self._planner.close()

    def _planner_after(self, steps: Sequence[Step]) -> ResumingPlanner:
        config = self.config
        live = LiveReplanner(self.house.geodesics, solver(config.planner), capacity=config.capacity)
        plans = [event for event in map(json.loads, lines_of(steps)) if event["event"] == "plan"]
        return ResumingPlanner(live, LoggedReplanner(plans, lambda: 0.0) if steps else None)

    def _append_step(self, lines: list[str], number: int) -> None:
        arrays, recording = self.session.trajectory.arrays(), self.session.recording
        state = recording.checkpoints.pop(number, None)
        checkpoint = None
        if state is not None:
            checkpoint = Checkpoint(state.physics.tobytes(), state.details_json(), state.hash)
        row = {name: column[-1].tobytes() for name, column in arrays.items() if name != "unknown_objects"}
        entry = Step(row, recording.last_hash, lines, self._human.controls, self.input, checkpoint)
        self._journal.append(encode(entry))
        if len(self.session.trajectory) >= ROWS:  # the journal has them
            self.session.trajectory = Trajectory(self.scene.index.names)
            recording.forget()

    def _resume(self, steps: Sequence[Step]) -> None:
        """Go from the last checkpoint to where the journal ends, with the plan that was shown there."""
        session, log = self.session, self._log
        arrays = arrays_of(self.scene.episode, steps)
        record = record_of(self.scene, steps, arrays)
        number = record.checkpoint_before(float(arrays["time"][-1]))
        first = 0 if number is None else int(record.recorded.checkpoint_step[number])
        if number is None:
            observation = self.world.reset()
            session.assistant.begin(observation)
        else:
            observation = self.world.restore(record.recorded.checkpoint(number))
            catch_up(record, first, session.assistant, self._planner.logged)
        session.recording = Recording(self.world, log, first=first)
        session.start(observation)
        self._planner.logged.clock = lambda: float(self.world.observation().time)
        self._human.recorded = [record.action(step) for step in range(len(steps) - 1, first - 1, -1)]
        scrolls = [(step, event["rows"]) for step, event in record.events if event["event"] == "scroll"]
        for step in range(first, len(steps)):
            for at, rows in scrolls:
                if at + 1 == step:
                    session.assistant.scroll(rows)
            if step == len(steps) - 1:  # what this step leads to was not logged any more
                log.muted = False
                self._planner.go_live(session.assistant.task_state(self.world.observation()))
            session.advance()
            if session.recording.last_hash != steps[step].state_hash:
                raise RecordError(
                    f"the journal does not lead to the state that it holds at step {step}; it was recorded by another "
                    "version or on another machine"
                )
        self._human.controls, self.input = steps[-1].controls, steps[-1].input


def _begun(journal: Journal, config: TrialConfig | None) -> tuple[TrialConfig, list[Step]]:
    """The trial of a journal, or the one given if it is empty, and its control steps.

    Raises:
        RecordError: There is no trial, or it is over.
    """
    if not journal.records:
        if config is None:
            raise RecordError("the journal is empty")
        return config, []
    opened, steps, closed = decode(journal.records)
    if closed is not None:
        raise RecordError("this session is over")
    return config_of(opened.config), steps


def config_of(settings: Mapping[str, Any]) -> TrialConfig:
    """The trial that `TrialConfig.settings` describes."""
    person, behaviour = (
        PersonDistribution.of(settings["person"]),
        BehaviourDistribution.of(settings["behaviour"]),
    )
    return TrialConfig(**{**settings, "person": person, "behaviour": behaviour})


def is_over(journal: Sequence[bytes]) -> bool:
    """Whether the session of a journal is over."""
    return bool(journal) and decode(journal)[2] is not None


def open_journal(folder: Path) -> Journal:
    """The journal of the session in a folder, which is made if it is not there."""
    folder.mkdir(parents=True, exist_ok=True)
    return Journal(folder / JOURNAL)
