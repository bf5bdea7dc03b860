"""The session of a recorded run, simulated again with the record as its user."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, cast

from numpy.typing import NDArray

from experiments.assistant import Assistant
from experiments.errors import RecordError, ReplayError
from experiments.house import House
from experiments.participants.base import WAIT, Decision, Moves, Percept
from experiments.recording import Recording, provenance
from experiments.records import Event, EventLog
from experiments.replaying.logged_plans import LoggedPlans
from experiments.replaying.run_record import WORLD_EVENTS, Fault, RunRecord
from experiments.session import INTERRUPTED, PHYSICS_ERROR, Session, Viewer
from mjsim.actions import WorldEvent
from mjsim.errors import PhysicsError, StateError
from mjsim.model.scene import compose
from mjsim.observation import Observation
from mjsim.options import WorldOptions
from mjsim.world import World
from planner.replanner import Replanner

MAX_ROLLOUT = 250  # control steps


class _EndOfReplay(Exception):  # noqa: N818 - no error: the record has no more to tell
    """There is nothing more to replay."""


class _RecordedUser:
    """The user of a replay: does what was recorded, having checked that the world is where it was then."""

    needs: frozenset[str] = frozenset()

    def __init__(self, record: RunRecord, world: World, recording: Recording) -> None:
        self._record, self._world, self._recording = record, world, recording
        self.fault: Fault | None = record.fault

    def act(self, percept: Percept) -> Decision:
        """What was recorded; raises `_EndOfReplay` where the record ends or goes wrong."""
        step, record = self._recording.step, self._record
        if step >= record.steps:
            self._stop(Fault(step, f"the run ended here ({record.reason}), the replay goes on"))
        if self._world.state_hash() != int(record.recorded.state_hash[step]):
            self._stop(Fault(step, "the state differs from the recorded one"))
        if record.fault is not None and step >= record.fault.step:
            raise _EndOfReplay
        if record.fault is None and step == record.steps - 1:
            if record.reason == INTERRUPTED:
                raise _EndOfReplay
            if record.reason != PHYSICS_ERROR:
                self._stop(Fault(step, f"the run ended here ({record.reason}), the replay goes on"))
        if percept.busy and self._waits(step):
            return WAIT
        moves = record.moves(step, min(step + MAX_ROLLOUT, self._last_sound))
        try:
            return Moves(moves) if len(moves) else record.action(step)
        except RecordError as error:
            self._stop(Fault(step, str(error)))
            raise

    def _waits(self, step: int) -> bool:
        """Whether nothing was asked until the pick or place under way was over."""
        until = self._record.next_event(step)
        if until is None or until >= self._last_sound:
            return False
        idle = self._record.moves(step, until + 1)
        return len(idle) == until + 1 - step and not idle.any()

    @property
    def _last_sound(self) -> int:
        """The first step that is not simply done again: where the record ends, or is damaged."""
        fault = self._record.fault
        return self._record.steps - 1 if fault is None else min(fault.step, self._record.steps - 1)

    def _stop(self, fault: Fault) -> None:
        if self.fault is None or fault.step < self.fault.step:
            self.fault = fault
        raise _EndOfReplay


class Replayer:
    """One replay.

    Args:
        record: What is replayed.
        house: The house of the run.
        start: Simulated time, s; the replay starts at the last checkpoint at or before it.
        assistance: Assistance condition whose glasses are shown.

    Attributes:
        first: Control step at which the replay starts.
        differences: What differs from when the run was recorded.
        failure: How the physics failed in the replay, or None.

    Raises:
        ReplayError: The record cannot be replayed, or is damaged before `first`.
    """

    def __init__(self, record: RunRecord, house: House, *, start: float, assistance: str) -> None:
        self.record, self.house = record, house
        self.scene = compose(record.episode, house.catalogue)
        try:
            self._world = World(self.scene, WorldOptions(**record.start["world"]))
        except TypeError as error:
            raise ReplayError(
                f"the rules of the recorded world are not those of this version: {error}"
            ) from error
        self.differences = tuple(_differences(record.start, provenance(self._world)))
        self.failure: str | None = None
        self._log = EventLog()
        self._plans = LoggedPlans([e for _, e in record.events if e["event"] == "plan"], lambda: 0.0)
        self._assistant = Assistant(
            house,
            record.episode,
            assistance=assistance,
            replanner=cast(Replanner, self._plans),
            order=record.start["order"],
            log=self._log,
        )
        number = record.checkpoint_before(start)
        self.first = 0 if number is None else int(record.recorded.checkpoint_step[number])
        if record.fault is not None and record.fault.step <= self.first:
            raise self.error(record.fault)
        self._observation = self._begin(number)
        self._logged_before = len(self._log.events)
        steps = [int(step) for step in record.recorded.checkpoint_step]
        self.recording = Recording(self._world, self._log, checkpoints=steps, first=self.first)
        self._user = _RecordedUser(record, self._world, self.recording)

    def run(self, viewer: Viewer | None, on_progress: Callable[[int, int], None]) -> None:
        """Replay to the end or to the first fault."""
        record, recording = self.record, self.recording
        session = Session(
            self._world,
            self._assistant,
            self._user,
            recording,
            walls=self.house.navmesh.outline,
            time_limit=float(record.start["time_limit"]),
            viewer=viewer,
        )
        self._plans.clock = lambda: float(self._world.data.time)
        try:
            session.start(self._observation)
            reason = session.finish(lambda _: on_progress(recording.step, record.steps))
            if reason == INTERRUPTED:
                raise KeyboardInterrupt
        except _EndOfReplay:
            if self._user.fault is None:  # the person stopped the run here: no more than the state is known
                recording.append()
                action, health = record.action(record.steps - 1), self._world.health_sample
                session.trajectory.append(self._world.observation(), action, health)
        except PhysicsError as error:
            self.failure = str(error)
        self._trajectory = session.trajectory

    @property
    def fault(self) -> Fault | None:
        """Why the replay stopped before the record's end, or None."""
        return self._user.fault

    @property
    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """The replay's own trajectory, from `first` on."""
        return self._trajectory.arrays()

    @property
    def events(self) -> list[dict[str, Any]]:
        """The replay's own log, from `first` on."""
        return self._log.events[self._logged_before :]

    def error(self, fault: Fault) -> ReplayError:
        """A fault as an error: which step, what, and why that may be."""
        reasons = f" (since it was recorded: {'; '.join(self.differences)})" if self.differences else ""
        return fault_error(self.record.directory, self.record.start, fault, reasons)

    def _begin(self, number: int | None) -> Observation:
        """Bring world and assistant to the start of the run, or to a checkpoint; what is seen there."""
        if number is None:
            observation = self._world.reset()
            self._assistant.begin(observation)
            return observation
        try:
            observation = self._world.restore(self.record.recorded.checkpoint(number))
        except StateError as error:
            raise self.error(Fault(self.first, str(error))) from error
        self._catch_up()
        return observation

    def _catch_up(self) -> None:
        """Let the assistant take note of everything recorded before the checkpoint, without any physics."""
        record, assistant = self.record, self._assistant
        assistant.begin(record.observation(0))
        happened: dict[int, list[Event]] = {}
        for step, event in record.events:
            happened.setdefault(step, []).append(event)
        for step in range(self.first):
            observation = record.observation(step + 1)
            self._plans.clock = _constant(observation.time)
            for event in happened.get(step, []):
                if event["event"] == "attempt" and event["refusal"] is not None:
                    assistant.say(event["refusal"], observation.time, event["object"])
            events = [_world_event(e) for e in happened.get(step, []) if e["event"] in WORLD_EVENTS]
            assistant.observe(observation, events)
            for seen in events:
                assistant.say(seen.kind.value, observation.time, seen.object)


def fault_error(directory: Path, start: Event, fault: Fault, reasons: str = "") -> ReplayError:
    """A fault as an error of one line that names the first bad step."""
    time = fault.step * float(start.get("world", {}).get("control_timestep", WorldOptions.control_timestep))
    return ReplayError(
        f"{directory}: first bad step {fault.step} (t = {time:.2f} s): {fault.what}{reasons}", fault.step
    )


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
