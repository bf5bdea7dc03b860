"""The participant of a replay: does what was recorded."""

from typing import Never

from experiments.errors import RecordError
from experiments.participants.base import WAIT, Decision, Moves, Percept
from experiments.replaying.record_checks import Mismatch
from experiments.replaying.run_record import RunRecord
from experiments.runs import records
from experiments.runs.recording import Recording
from experiments.session.endings import PHYSICS_ERROR, LeaveSession
from mjsim.world import World

MAX_ROLLOUT = 250  # control steps


class EndOfReplay(LeaveSession):
    """The record ends here, or differs from the replay."""


class RecordedParticipant:
    """Does what was recorded, as long as the state of the world is the recorded one.

    Args:
        record: The record of the run.
        world: The world of the replay.
        recording: The recording of the replay.

    Attributes:
        mismatch: The first mismatch with the record, or None.
    """

    needs: frozenset[str] = frozenset()

    def __init__(self, record: RunRecord, world: World, recording: Recording) -> None:
        self._record, self._world, self._recording = record, world, recording
        self.mismatch: Mismatch | None = record.mismatch

    def act(self, percept: Percept) -> Decision:
        """The recorded decision.

        Raises:
            EndOfReplay: The record ends here, or differs from the replay.
        """
        step, record = self._recording.step, self._record
        if step >= record.steps:
            self._stop(step, f"the run ended here ({record.reason}), the replay goes on")
        if self._world.state_hash() != int(record.recorded.state_hash[step]):
            self._stop(step, "the state differs from the recorded one")
        if record.mismatch is not None and step >= record.mismatch.step:
            raise EndOfReplay
        if record.mismatch is None and step == record.steps - 1:
            if record.broke_off:
                raise EndOfReplay
            if record.reason != PHYSICS_ERROR:
                self._stop(step, f"the run ended here ({record.reason}), the replay goes on")
        if percept.busy and self._waits(step):
            return WAIT
        moves = record.moves(step, min(step + MAX_ROLLOUT, self._last_valid_step))
        try:
            return Moves(moves) if len(moves) else record.action(step)
        except RecordError as error:
            self._stop(step, str(error))

    def _waits(self, step: int) -> bool:
        """Whether nothing was done until the end of the current pick or place."""
        end = self._record.next_event(step)
        if end is None or end >= self._last_valid_step:
            return False
        idle = self._record.moves(step, end + 1)
        return len(idle) == end + 1 - step and not idle.any()

    @property
    def _last_valid_step(self) -> int:
        """The last step of the record, or the step of its first mismatch."""
        last, mismatch = self._record.steps - 1, self._record.mismatch
        return last if mismatch is None else min(mismatch.step, last)

    def _stop(self, step: int, message: str) -> Never:
        if self.mismatch is None or step < self.mismatch.step:
            self.mismatch = Mismatch(step, message, records.RECORDING)
        raise EndOfReplay
