"""The one loop: observe, show, let the user act, step the world. A script, a person and a replay all run in it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from experiments.assistant import Assistant
from experiments.errors import SessionError
from experiments.participants.base import NEARBY, Participant, Percept
from experiments.recording import Recording
from experiments.records import EventLog, Trajectory
from hud.state import HudState
from mjsim.actions import IDLE, Action, ActionResult
from mjsim.errors import PhysicsError
from mjsim.observation import ObjectStatus, Observation
from mjsim.visibility import visible_objects
from mjsim.world import StepResult, World

ALL_DELIVERED, TIME_LIMIT, INTERRUPTED, PHYSICS_ERROR = (
    "all delivered",
    "time limit",
    "interrupted",
    "physics error",
)
AFTERGLOW = 1.6  # s the session goes on after the last delivery, so that the person sees that all is done


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
    ) -> None:
        self._world = world
        self._assistant = assistant
        self._participant = participant
        self._log = log
        self._targets = targets
        self._time_limit = time_limit
        self._viewer = viewer
        self._shown: frozenset[str] = frozenset()
        self._recorded_until = 0.0
        self.trajectory = Trajectory(world.scene.index.names)
        self.recording = recording or Recording(world, log)

    def run(self, on_progress: Callable[[Progress], None] = lambda _: None) -> str:
        """Run from the start to the end; returns why it ended: `all delivered`, `time limit` or `interrupted`.

        Raises:
            SessionError: The participant needs guidance that the assistance condition does not show.
            PhysicsError: The physics failed; the log says when.
        """
        observation = self._world.reset()
        self._assistant.begin(observation)
        return self.resume(observation, on_progress)

    def resume(
        self, observation: Observation, on_progress: Callable[[Progress], None] = lambda _: None
    ) -> str:
        """Run to the end from where the world and the assistant are now; returns and raises as `run` does."""
        self._shown = frozenset(m.role for m in self._assistant.hud_state(observation).markers)
        if not self._participant.needs <= self._shown:
            raise SessionError(
                f"this participant needs {sorted(self._participant.needs)} markers but the assistance condition shows "
                f"{sorted(self._shown) or 'none'}; choose another --user or --assistance"
            )
        try:
            observation, reason = self._until_done(observation, on_progress)
        except KeyboardInterrupt:
            # What has been done so far is kept and measured, as it would be for a person who stops early.
            observation, reason = self._world.observation(), INTERRUPTED
        except PhysicsError as error:
            self._log.append(self._recorded_until, "end", reason=PHYSICS_ERROR, error=str(error))
            raise
        self._log.append(observation.time, "end", reason=reason)
        return reason

    def _until_done(
        self, observation: Observation, on_progress: Callable[[Progress], None]
    ) -> tuple[Observation, str]:
        answer: ActionResult | None = None
        total = len(observation.object_names)
        while observation.time < self._time_limit - 1e-9:
            observation = self.recording.pass_checkpoint(observation)
            self._film(observation)
            action = self._participant.act(self._percept(observation, answer))
            self._record(observation, action)
            step = self._world.step(action)
            observation, answer = step.observation, step.result
            self._take_note(step)
            delivered = len(observation.names_with(ObjectStatus.DELIVERED))
            on_progress(Progress(observation.time, delivered, total))
            if delivered == total:
                self._assistant.say("finished", observation.time)
                self._record(observation, IDLE)
                self._glow(observation)
                return observation, ALL_DELIVERED
        self._record(observation, IDLE)
        return observation, TIME_LIMIT

    def _record(self, observation: Observation, action: Action) -> None:
        self._recorded_until = observation.time
        self.recording.append()
        self.trajectory.append(observation, action)

    def _glow(self, observation: Observation) -> None:
        """Let the viewer see the end for a moment; nothing of it is measured."""
        if self._viewer is None:
            return
        until = observation.time + AFTERGLOW
        while observation.time < until:
            self._film(observation)
            observation = self._world.step(IDLE).observation

    def _take_note(self, step: StepResult) -> None:
        observation = step.observation
        if step.result is not None:
            self._note_attempt(observation.time, step.result)
        for event in step.events:
            self._log.append(event.time, event.kind.value, object=event.object, receptacle=event.receptacle)
        self._assistant.observe(observation, step.events)
        for event in step.events:
            self._assistant.say(event.kind.value, observation.time, event.object)

    def _note_attempt(self, time: float, result: ActionResult) -> None:
        kind = type(result.action).__name__.lower()
        refusal = result.refusal.value if result.refusal else None
        self._log.append(
            time, "attempt", action=kind, object=result.object, applied=result.applied, refusal=refusal
        )
        if refusal is not None:
            self._assistant.say(refusal, time, result.object)

    def _film(self, observation: Observation) -> None:
        if self._viewer is not None:
            self._viewer.show(self._world, observation, self._assistant)

    def _percept(self, observation: Observation, answer: ActionResult | None) -> Percept:
        def hud() -> HudState:
            return self._assistant.hud_state(observation)

        def look() -> dict[str, NDArray[np.float64]]:
            seen = visible_objects(
                self._world.scene, self._world.data, observation.eye, observation.heading, observation.pitch
            )
            # What has been put away stays in view, in its bin, but nobody takes it for misplaced.
            loose = set(observation.names_with(ObjectStatus.LOOSE))
            return {name: _position_of(observation, name) for name in seen if name in loose}

        return Percept(
            time=observation.time,
            position=observation.position,
            heading=observation.heading,
            hands=observation.hands,
            busy=observation.busy,
            hud=hud,
            guidance=self._assistant.guidance(observation) if "goal" in self._shown else None,
            flagpoles=self._flagpoles(observation),
            targets=self._targets,
            answer=answer,
            nearby=self._nearby(observation),
            look=look,
        )

    def _nearby(self, observation: Observation) -> dict[str, NDArray[np.float64]]:
        gaps = np.linalg.norm(observation.object_positions[:, :2] - observation.position, axis=1)
        return {
            observation.object_names[i]: observation.object_positions[i, :2]
            for i in np.flatnonzero(gaps < NEARBY)
            if observation.object_status[i] is ObjectStatus.LOOSE
        }

    def _flagpoles(self, observation: Observation) -> dict[str, NDArray[np.float64]]:
        if "flagpole" not in self._shown:
            return {}
        return {n: _position_of(observation, n) for n in observation.names_with(ObjectStatus.LOOSE)}


def _position_of(observation: Observation, name: str) -> NDArray[np.float64]:
    return observation.object_positions[observation.object_names.index(name), :2]
