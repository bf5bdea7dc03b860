"""Simulate a recorded run again, using the plans in its log."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Never

from experiments.errors import RecordError, ReplayError
from experiments.house import House
from experiments.participants.base import Percept
from experiments.record.phases import COMPLETE, PHYSICS_ERROR
from experiments.record.reader import Record
from experiments.record.records import METRICS, RECORDING, Event, EventLog
from experiments.record.verify import Mismatch
from experiments.record.writer import RecordWriter, provenance
from experiments.session.assistant import Assistant
from experiments.session.session import Session, Viewer
from experiments.session.task_board import TaskBoard
from mjsim.house.scene.scene import compose
from mjsim.values.errors import ActionError, PhysicsError, StateError
from mjsim.values.observation import Steps
from mjsim.values.options import WorldOptions
from mjsim.world.world import World
from planner.errors import ProblemError
from planner.plan import Plan, Status, Visit, VisitKind
from planner.regret import RegretEvaluator
from planner.route import PlanSource, Route, TaskState
from planner.service import Planner


class Replayer:
    """A replay of a recorded run.

    Args:
        directory: The run directory.
        record: Record of the run, which must be undamaged.
        house: The house of the run.
        start: Simulated time in seconds. The replay starts at the last checkpoint at or before it.
        assistance: Assistance condition whose HUD is shown.

    Attributes:
        first: Control step at which the replay starts.
        mismatch: Mismatch that stopped the replay before the end of the record, or None.
        differences: Versions and models that differ from those of the recording.
        failure: Physics error in the replay, or None.

    Raises:
        ReplayError: This version of mjsim cannot replay the record.
    """

    def __init__(
        self, directory: Path, record: Record, house: House, *, start: float, assistance: str
    ) -> None:
        house = house.for_person(record.person)
        self.directory, self.record, self.house = directory, record, house
        self.scene = compose(record.episode, house.catalogue, person=record.person)
        try:
            self._world = World(self.scene, WorldOptions(**record.start["world"]))
        except (TypeError, ActionError) as error:
            raise ReplayError(
                f"this version has other options of the world: {error}; the first bad step is 0",
                0,
            ) from error
        self._assistance = assistance
        self._checkpoint = record.checkpoint_before(start)
        self._log = EventLog()
        self._written = RecordWriter(record.episode, self._log, checkpoints=record.checkpoint_steps)
        self.first = self._checkpoint or 0
        self.mismatch: Mismatch | None = None
        self.failure: str | None = None
        self.differences = tuple(_differences(record.start, provenance(self._world)))

    def run(self, viewer: Viewer | None, on_progress: Callable[[int, int], None]) -> None:
        """Replay the run until its end or until the first mismatch."""
        session, steps = self._restored_session(viewer), self.record.steps
        try:
            for step in range(self.first, steps):
                session.repeat_events(self.record, step)
                if not self._repeat(session, step):
                    return
                on_progress(step + 1, steps)
        except PhysicsError as error:
            session.fail(error)
            self.failure = str(error)

    def replayed(self) -> Record:
        """Return the record of the replay from step `first` on. The log also contains all earlier events."""
        return self._written.record()

    def _restored_session(self, viewer: Viewer | None) -> Session:
        record = self.record
        evaluator = RegretEvaluator(self.house.geodesics, capacity=self._world.options.capacity)
        assistant = Assistant(
            TaskBoard(self.house, record.episode, record.start["order"], record.person.eye_height),
            assistance=self._assistance,
            planner=Planner(LogSource(record.plans, lambda: session.time), evaluator),
            log=self._log,
            options=self._world.options,
        )
        limit = float(record.start["time_limit"])
        session = Session(
            self._world, assistant, _NoParticipant(), self._written, time_limit=limit, viewer=viewer
        )
        try:
            session.restore(record, self._checkpoint)
        except StateError as error:
            mismatch = Mismatch(self.first, str(error), RECORDING)
            raise mismatch_error(self.directory, record, mismatch, self.differences) from error
        return session

    def _repeat(self, session: Session, step: int) -> bool:
        record, is_last = self.record, step == self.record.steps - 1
        if (reason := session.end_reason) is not None:
            session.end(reason)
            return False
        if is_last and record.reason in COMPLETE:
            return self._stop(step, f"the run ended here ({record.reason}), the replay continues")
        try:
            action = record.action(step)
        except RecordError as error:
            return self._stop(step, str(error))
        if is_last and record.reason != PHYSICS_ERROR:
            seen = self._written.pass_checkpoint(self._world, self._world.observation())
            self._written.append(seen, self._world.health_sample, self._world.state_hash(), Steps(action))
        else:
            session.repeat(action)
        if self._written.last_state_hash != int(record.recording["state_hash"][step]):
            return self._stop(step, "the state differs from the recorded one")
        return True

    def _stop(self, step: int, message: str) -> bool:
        self.mismatch = Mismatch(step, message, RECORDING)
        return False


class _NoParticipant:
    needs: frozenset[str] = frozenset()

    def act(self, percept: Percept) -> Never:
        raise NotImplementedError


def mismatch_error(
    directory: Path,
    record: Record,
    mismatch: Mismatch,
    differences: tuple[str, ...] = (),
    verdicts: tuple[object, ...] = (),
) -> ReplayError:
    """Return an error that names the control step and the possible causes of a mismatch."""
    timestep = record.start.get("world", {}).get("control_timestep", WorldOptions.control_timestep)
    if mismatch.step is None:
        where = "no step differs, but a file does"
    else:
        where = f"first bad step {mismatch.step} (t = {mismatch.step * float(timestep):.2f} s)"
    is_metrics = mismatch.file == METRICS
    hint = f"; `mjsim metrics {directory}` computes the metrics again" if is_metrics else ""
    reasons = f" (since it was recorded: {'; '.join(differences)})" if differences else ""
    line = f"{directory}: {where}: {mismatch.message}{reasons}{hint}"
    return ReplayError(line, mismatch.step, [str(verdict) for verdict in verdicts])


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


class LogSource(PlanSource):
    """A source of plans that returns the logged plans at their logged times.

    Args:
        plans: The `plan` events of the log, in order.
        clock: Function that returns the simulated time in seconds.
    """

    def __init__(self, plans: Sequence[Event], clock: Callable[[], float] = lambda: 0.0) -> None:
        self.clock = clock
        self._plans = list(plans)

    def rest(self, route: Route, state: TaskState) -> tuple[Visit, ...] | None:
        """Return the remaining visits, or None if a plan was logged at the current time."""
        return None if self._is_due else tuple(v for v in route.visits if _is_open(v, state))

    def plan(self, state: TaskState, route: Route | None, *, shown: bool) -> Route:  # noqa: ARG002 - both are logged
        """Return the plan that was logged at the current time. Every run logs a plan at the start."""
        if not self._is_due:
            raise ReplayError("the log has no plan for the start of the task; the first bad step is 0", 0)
        return _route(self._plans.pop(0), state)

    @property
    def pending(self) -> bool:
        """True if a better plan for the same task was logged at the current time."""
        return self._is_due and bool(self._plans[0].get("improved", False))

    def better(self, state: TaskState, route: Route) -> Route | None:
        """Return the improved plan if one was logged at the current time. Otherwise, return None."""
        return self.plan(state, route, shown=True) if self.pending else None

    @property
    def _is_due(self) -> bool:
        return bool(self._plans) and self._plans[0]["t"] <= round(self.clock(), 6)


def _is_open(visit: Visit, state: TaskState) -> bool:
    if visit.kind is VisitKind.PICK:
        return visit.object in state.loose
    return visit.object in state.loose or visit.object in state.carried


def _route(event: Event, state: TaskState) -> Route:
    try:
        cost = float(event["cost_m"])
        plan = Plan((), cost, float(event["lower_bound_m"]), Status(event["status"]), seconds=0.0)
        visits = []
        for kind, name in event["visits"]:
            if name not in (state.loose if kind == "pick" else state.deliveries):
                raise ValueError(f"nothing to {kind} is called {name!r}")
            visits.append(Visit(VisitKind(kind), name))
        return Route(tuple(visits), plan)
    except (KeyError, TypeError, ValueError, ProblemError) as error:
        raise ReplayError(f"the plan logged at t = {event['t']} s is malformed: {error!r}") from error
