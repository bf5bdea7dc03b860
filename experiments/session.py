"""The one loop: observe, show, let the user act, step the world. A script, a person and a replay all run in it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from experiments.assistant import OFF_THE_PATH, Assistant
from experiments.errors import SessionError
from experiments.participants.base import Foreseeing, Guidance, Outlook, Participant, Percept, Things
from experiments.participants.visit_tasks import NO_MOVES
from experiments.recording import Recording
from experiments.records import EventLog, Trajectory
from mjsim.actions import IDLE, Action, ActionResult, WorldEvent
from mjsim.errors import PhysicsError
from mjsim.observation import ObjectStatus, Observation
from mjsim.visibility import visible_objects
from mjsim.world import World

ALL_DELIVERED, TIME_LIMIT, INTERRUPTED, PHYSICS_ERROR = (
    "all delivered",
    "time limit",
    "interrupted",
    "physics error",
)
FINAL_HOLD = 1.6  # s the session goes on after the last delivery, so that the person sees that all is done
MAX_MOTION = 30.0  # s; no pick or place takes as long


class Viewer(Protocol):
    """Takes what is shown at every control step, e.g. to film it."""

    def show(self, world: World, observation: Observation, assistant: Assistant) -> None:
        """Show the present state."""
        ...


@dataclass(frozen=True)
class Progress:
    """How far a session has got, for progress bars."""

    time: float
    delivered: int
    total: int


OnProgress = Callable[[Progress], None]


class Session:
    """One trial from the start pose until everything is delivered or the time is up.

    Args:
        world: The physics, freshly made.
        assistant: Plans and fills the glasses.
        participant: The user.
        log: Takes the events.
        targets: Object instance name -> receptacle key.
        time_limit: Simulated time after which the session ends, s.
        viewer: Sees every control step, or None.
        recording: Hashes every control step; None for one that decides on checkpoints by itself.
        foresight: Take many control steps at once where nobody has to see each of them: the fidelity is not `full`,
            the participant foresees its moves, and there is no viewer. The run is the same without.

    Attributes:
        trajectory: Poses and actions so far.
        recording: Hashes and checkpoints so far.
    """

    def __init__(
        self,
        world: World,
        assistant: Assistant,
        participant: Participant,
        *,
        log: EventLog,
        targets: Mapping[str, str],
        time_limit: float,
        viewer: Viewer | None = None,
        recording: Recording | None = None,
        foresight: bool = True,
    ) -> None:
        self._world = world
        self._assistant = assistant
        self._participant = participant
        self._log = log
        self._targets = targets
        self._time_limit = time_limit
        self._viewer = viewer
        self._shown: frozenset[str] = frozenset()
        self._answer: ActionResult | None = None
        self._recorded_until = 0.0
        self._foreseeing: Foreseeing | None = None
        if foresight and viewer is None and world.options.fidelity != "full":
            self._foreseeing = participant if isinstance(participant, Foreseeing) else None
        self._minded: tuple[tuple[ObjectStatus, ...], NDArray[np.bool_]] = ((), np.zeros(0, np.bool_))
        self.trajectory = Trajectory(world.scene.index.names)
        self.recording = recording or Recording(world, log)

    def run(self, on_progress: OnProgress = lambda _: None) -> str:
        """Run from the start to the end; returns why it ended: `all delivered`, `time limit` or `interrupted`.

        Raises:
            SessionError: The participant needs guidance that the assistance condition does not show.
            PhysicsError: The physics failed; the log says when.
        """
        observation = self._world.reset()
        self._assistant.begin(observation)
        self.start(observation)
        return self.finish(on_progress)

    def start(self, observation: Observation) -> None:
        """Start from where the world and the assistant are now.

        Raises:
            SessionError: The participant needs guidance that the assistance condition does not show.
        """
        self._now = observation
        self._shown = frozenset(m.role for m in self._assistant.hud_state(observation).markers)
        if not self._participant.needs <= self._shown:
            raise SessionError(
                f"this participant needs {sorted(self._participant.needs)} markers but the assistance condition shows "
                f"{sorted(self._shown) or 'none'}; choose another --user or --assistance"
            )

    def finish(self, on_progress: OnProgress = lambda _: None) -> str:
        """Go on to the end, once started; returns and raises as `run` does."""
        try:
            reason = self._end_reason
            while reason is None:
                self.advance()
                on_progress(self.progress)
                reason = self._end_reason
            self._end(reason)
        except KeyboardInterrupt:
            # What has been done so far is kept and measured, as it would be for a person who stops early.
            reason = INTERRUPTED
        except PhysicsError as error:
            self._log.append(self._recorded_until, "end", reason=PHYSICS_ERROR, error=str(error))
            raise
        self._assistant.finish(self._now.time)
        self._log.append(self._now.time, "end", reason=reason)
        return reason

    @property
    def progress(self) -> Progress:
        """How far the session has got."""
        delivered = sum(status is ObjectStatus.DELIVERED for status in self._now.object_status)
        return Progress(self._now.time, delivered, len(self._now.object_names))

    def advance(self) -> None:
        """Let the participant decide once, and do that: one control step, or many that nobody has to see.

        Raises:
            PhysicsError: The physics failed.
        """
        self._now = self.recording.pass_checkpoint(self._now)
        self._film()
        percept = self._percept(self._answer)
        moves = None if self._foreseeing is None else self._foresee(self._foreseeing, percept)
        if moves is None:
            self._step(self._participant.act(percept))
        else:
            self._answer = None
            self._stride(moves)

    @property
    def _end_reason(self) -> str | None:
        """Why the session is over, or None if it is not."""
        progress = self.progress
        if progress.delivered == progress.total:
            return ALL_DELIVERED
        return TIME_LIMIT if progress.time >= self._time_limit - 1e-9 else None

    def _end(self, reason: str) -> None:
        """Record the last state, and let the viewer see that all is done."""
        if reason == ALL_DELIVERED:
            self._assistant.say("finished", self._now.time)
        self._record(IDLE)
        if reason == ALL_DELIVERED:
            self._hold_final_view()

    def _step(self, action: Action) -> None:
        """One control step, observed by everybody."""
        self._record(action)
        step = self._world.step(action)
        self._now, self._answer = step.observation, step.result
        if step.result is not None:
            self._note_attempt(self._now.time, step.result)
        self._take_note(step.events)

    def _foresee(self, participant: Foreseeing, percept: Percept) -> NDArray[np.float64] | None:
        """Moves of many control steps at once, none to wait for a pick or place; None where each has to be observed."""
        left = int((self._time_limit - percept.time) / self._world.control_timestep) - 1
        if self._assistant.expecting or (percept.answer is not None and not percept.answer.applied):
            return None
        if percept.busy:
            in_time = left * self._world.control_timestep > MAX_MOTION
            return NO_MOVES if in_time and participant.waits() else None
        limit = min(left, self.recording.steps_to_checkpoint)
        locomotion = self._world.locomotion
        if limit < 1 or locomotion is None:
            return None
        moves = participant.foresee(percept, Outlook(locomotion, limit, stray=OFF_THE_PATH))
        return moves if len(moves) else None

    def _stride(self, moves: NDArray[np.float64]) -> None:
        """Many control steps, recorded as if they had been observed one by one."""
        self._recorded_until = self._now.time
        self.recording.append()
        health = self._world.health_sample
        walks = len(moves) > 0
        stretch = self._world.walk(moves) if walks else self._world.finish()
        count = len(stretch)
        self.recording.extend(stretch.state_hashes[:-1])
        self.trajectory.extend(self._now, health, stretch, moves[:count] if walks else np.zeros((count, 4)))
        self._now = stretch.observation
        if walks:
            if self._foreseeing is not None:
                self._foreseeing.went(count)
            quiet = count - 1 if stretch.events else count
            self._assistant.walked(stretch.positions[:quiet], self._now)
        if stretch.events or not walks:
            self._take_note(stretch.events)

    def _record(self, action: Action) -> None:
        self._recorded_until = self._now.time
        self.recording.append()
        self.trajectory.append(self._now, action, self._world.health_sample)

    def _hold_final_view(self) -> None:
        """Let the viewer see the end for a moment; nothing of it is measured."""
        end = self._now
        while self._viewer is not None and self._now.time < end.time + FINAL_HOLD:
            self._film()
            self._now = self._world.step(IDLE).observation
        self._now = end

    def _take_note(self, events: tuple[WorldEvent, ...]) -> None:
        for event in events:
            self._log.append(event.time, event.kind.value, object=event.object, receptacle=event.receptacle)
        self._assistant.observe(self._now, events)
        for event in events:
            self._assistant.say(event.kind.value, self._now.time, event.object)

    def _note_attempt(self, time: float, result: ActionResult) -> None:
        kind = type(result.action).__name__.lower()
        refusal = result.refusal.value if result.refusal else None
        self._log.append(
            time, "attempt", action=kind, object=result.object, applied=result.applied, refusal=refusal
        )
        if refusal is not None:
            self._assistant.say(refusal, time, result.object)

    def _film(self) -> None:
        if self._viewer is not None:
            self._viewer.show(self._world, self._now, self._assistant)

    def _percept(self, answer: ActionResult | None) -> Percept:
        seen = self._now
        return Percept(
            time=seen.time,
            position=seen.position,
            heading=seen.heading,
            hands=seen.hands,
            busy=seen.busy,
            targets=self._targets,
            answer=answer,
            things=self._things(seen),
            hud=partial(self._assistant.hud_state, seen),
            look=partial(self._look, seen),
            find_guidance=partial(self._guidance, seen),
            find_flagpoles=partial(self._flagpoles, seen),
            find_choices=partial(self._assistant.choices, seen),
        )

    def _look(self, observation: Observation) -> dict[str, NDArray[np.float64]]:
        # What has been put away stays in view, in its bin, but nobody takes it for misplaced.
        seen = visible_objects(
            self._world.scene,
            self._world.data,
            observation.eye,
            observation.heading,
            observation.pitch,
            among=observation.names_with(ObjectStatus.LOOSE),
        )
        return {name: _position_of(observation, name) for name in seen}

    def _guidance(self, observation: Observation) -> Guidance | None:
        return self._assistant.guidance(observation) if "goal" in self._shown else None

    def _flagpoles(self, observation: Observation) -> dict[str, NDArray[np.float64]]:
        if "flagpole" not in self._shown:
            return {}
        return {n: _position_of(observation, n) for n in observation.names_with(ObjectStatus.LOOSE)}

    def _things(self, observation: Observation) -> Things:
        status, minded = self._minded
        if observation.object_status != status:
            status = observation.object_status
            minded = np.array([s is ObjectStatus.LOOSE for s in status])
            self._minded = status, minded
        # Kernels are compiled for arrays without gaps.
        return Things(observation.object_names, np.ascontiguousarray(observation.object_positions), minded)


def _position_of(observation: Observation, name: str) -> NDArray[np.float64]:
    return observation.object_positions[observation.object_names.index(name), :2]
