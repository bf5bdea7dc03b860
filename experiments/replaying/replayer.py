"""Simulates the session of a recorded run again."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from experiments.errors import ReplayError
from experiments.house import House
from experiments.replaying.logged_replanner import LoggedReplanner
from experiments.replaying.record_checks import Mismatch
from experiments.replaying.recorded_participant import EndOfReplay, RecordedParticipant
from experiments.replaying.run_record import EXTERNAL, WORLD_EVENTS, RunRecord
from experiments.runs.recording import Recording, provenance
from experiments.runs.records import RECORDING, Event, EventLog
from experiments.session.assistant import Assistant
from experiments.session.endings import INTERRUPTED
from experiments.session.session import Session
from experiments.session.task_board import TaskBoard
from experiments.session.viewer import Progress, Viewer
from mjsim.actions import WorldEvent
from mjsim.errors import ActionError, PhysicsError, StateError
from mjsim.model.scene import compose
from mjsim.observation import Observation
from mjsim.options import WorldOptions
from mjsim.world import World


class Replayer:
    """One replay.

    Args:
        record: The record of the run.
        house: The house of the run.
        start: Simulated time, s; the replay starts at the last checkpoint at or before it.
        assistance: Assistance condition whose HUD is shown.

    Attributes:
        scene: The composed episode.
        first: Control step at which the replay starts.
        recording: Hashes and checkpoints of the replay.
        differences: Versions and models that differ from those of the recording.
        failure: Error of the physics in the replay, or None.

    Raises:
        ReplayError: The record cannot be replayed, or is damaged at or before `first`.
    """

    def __init__(self, record: RunRecord, house: House, *, start: float, assistance: str) -> None:
        house = house.for_person(record.person)
        self.record, self.house = record, house
        self.scene = compose(record.episode, house.catalogue, person=record.person)
        try:
            self._world = World(self.scene, WorldOptions(**record.start["world"]))
        except (TypeError, ActionError) as error:
            raise ReplayError(
                f"the options of the recorded world are not those of this version: {error}; the first bad step is 0",
                0,
            ) from error
        self.differences = tuple(_differences(record.start, provenance(self._world)))
        self.failure: str | None = None
        self._log = EventLog()
        self._replanner = LoggedReplanner([e for _, e in record.events if e["event"] == "plan"], lambda: 0.0)
        self._assistant = Assistant(
            TaskBoard(house, record.episode, record.start["order"]),
            assistance=assistance,
            planner=self._replanner,
            log=self._log,
            options=self._world.options,
        )
        number = record.checkpoint_before(start)
        self.first = 0 if number is None else int(record.recorded.checkpoint_step[number])
        if record.mismatch is not None and record.mismatch.step <= self.first:
            raise self.error(record.mismatch)
        self._observation = self._begin(number)
        self._logged_before = 0 if number is None else len(self._log.events)
        steps = [int(step) for step in record.recorded.checkpoint_step]
        self.recording = Recording(self._world, self._log, checkpoints=steps, first=self.first)
        self._external = [e for step, e in record.events if e["event"] in EXTERNAL and step >= self.first]
        self._participant = RecordedParticipant(record, self._world, self.recording)

    def run(self, viewer: Viewer | None, on_progress: Callable[[int, int], None]) -> None:
        """Replay to the end or to the first mismatch.

        Raises:
            KeyboardInterrupt: The user interrupted the replay.
        """
        record, recording = self.record, self.recording
        session = Session(
            self._world,
            self._assistant,
            self._participant,
            recording,
            walls=self.house.navmesh.outline,
            time_limit=float(record.start["time_limit"]),
            viewer=viewer,
        )
        self._replanner.clock = lambda: float(self._world.data.time)

        def advanced(_: Progress) -> None:
            self._repeat_external(session)
            on_progress(recording.step, record.steps)

        try:
            session.start(self._observation)
            self._repeat_external(session)
            reason = session.finish(advanced)
            if reason == INTERRUPTED:
                raise KeyboardInterrupt
        except EndOfReplay:
            if self._participant.mismatch is None:  # the run was interrupted here: only the state is known
                recording.append()
                action, health = record.action(record.steps - 1), self._world.health_sample
                session.trajectory.append(self._world.observation(), action, health)
        except PhysicsError as error:
            self.failure = str(error)
        self._trajectory = session.trajectory

    def _repeat_external(self, session: Session) -> None:
        """Repeat what came from outside of the simulation in the present state, such as scrolling the task list."""
        while self._external and self._external[0]["t"] <= round(session.progress.time, 6):
            event = self._external.pop(0)
            if event["event"] == "scroll":
                session.scroll(int(event["rows"]))
            else:
                fields = {name: value for name, value in event.items() if name not in ("t", "event")}
                session.note(event["event"], **fields)

    @property
    def mismatch(self) -> Mismatch | None:
        """Why the replay stopped before the end of the record, or None."""
        return self._participant.mismatch

    @property
    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Trajectory of the replay, from `first` on; names and shapes as in `Trajectory`."""
        return self._trajectory.arrays()

    @property
    def events(self) -> list[dict[str, Any]]:
        """Log of the replay, from `first` on."""
        return self._log.events[self._logged_before :]

    def error(self, mismatch: Mismatch, verdicts: Sequence[object] = ()) -> ReplayError:
        """The error of a mismatch: which step, what differs, possible reasons, and the verdicts of the files."""
        reasons = f" (since it was recorded: {'; '.join(self.differences)})" if self.differences else ""
        error = mismatch_error(self.record.directory, self.record.start, mismatch, reasons)
        return ReplayError(str(error), error.step, [str(verdict) for verdict in verdicts])

    def _begin(self, number: int | None) -> Observation:
        """Set world and assistant to the start of the run, or to a checkpoint; returns the state there."""
        if number is None:
            observation = self._world.reset()
            self._assistant.begin(observation)
            return observation
        try:
            observation = self._world.restore(self.record.recorded.checkpoint(number))
        except StateError as error:
            raise self.error(Mismatch(self.first, str(error), RECORDING)) from error
        catch_up(self.record, self.first, self._assistant, self._replanner)
        return observation


def catch_up(record: RunRecord, first: int, assistant: Assistant, replanner: LoggedReplanner) -> None:
    """Tell an assistant what was recorded before control step `first`; this needs no physics."""
    assistant.begin(record.observation(0))
    events_of_step: dict[int, list[Event]] = {}
    for step, event in record.events:
        events_of_step.setdefault(step, []).append(event)
    for step in range(first):
        observation = record.observation(step + 1)
        replanner.clock = _constant(observation.time)
        for event in events_of_step.get(step, []):
            if event["event"] == "attempt" and event["refusal"] is not None:
                assistant.show_message(event["refusal"], observation.time, event["object"])
        events = [_world_event(e) for e in events_of_step.get(step, []) if e["event"] in WORLD_EVENTS]
        assistant.observe(observation, events)
        for event in events_of_step.get(step, []):
            if event["event"] == "scroll":
                assistant.scroll(int(event["rows"]))


def mismatch_error(directory: Path, start: Event, mismatch: Mismatch, reasons: str = "") -> ReplayError:
    """The error of a mismatch: one line that names the first bad step."""
    timestep = start.get("world", {}).get("control_timestep", WorldOptions.control_timestep)
    where = f"first bad step {mismatch.step} (t = {mismatch.step * float(timestep):.2f} s)"
    return ReplayError(f"{directory}: {where}: {mismatch.message}{reasons}", mismatch.step)


def _constant(value: float) -> Callable[[], float]:
    return lambda: value


def _world_event(event: Event) -> WorldEvent:
    return WorldEvent(float(event["t"]), WORLD_EVENTS[event["event"]], event["object"], event["receptacle"])


def _differences(then: Event, now: Mapping[str, Any]) -> list[str]:
    labels = {"mujoco": "MuJoCo", "physics_code": "mjsim's physics code"}
    found = []
    for name, value in now["versions"].items():
        before = then.get("versions", {}).get(name)
        if before != value:
            found.append(f"{labels.get(name, name)} was {before}, is {value}")
    if then.get("model") != now["model"]:
        found.append(f"the compiled house was {then.get('model')}, is {now['model']}")
    return found
