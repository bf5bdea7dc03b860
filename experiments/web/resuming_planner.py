"""The planner of a session that goes on after a crash: first the plans of the log, then live ones."""

from experiments.replaying.logged_replanner import LoggedReplanner
from planner.live import LiveReplanner
from planner.route import Route, TaskState


class ResumingPlanner:
    """Gives the plans of a log until it goes live.

    Args:
        live: Plans beside the person.
        logged: The plans so far; None where there are none.
    """

    def __init__(self, live: LiveReplanner, logged: LoggedReplanner | None) -> None:
        self._live = live
        self._logged = logged
        self._now: LiveReplanner | LoggedReplanner = logged or live

    @property
    def logged(self) -> LoggedReplanner:
        """The plans so far.

        Raises:
            ValueError: There are none.
        """
        if self._logged is None:
            raise ValueError("no plans were logged")
        return self._logged

    @property
    def replans(self) -> int:
        """How often there was a new plan."""
        return self._now.replans

    @property
    def pending(self) -> bool:
        """Whether `poll` may have a better route."""
        return self._now.pending

    def prepare(self, state: TaskState, *, seconds: float | None = None) -> Route:
        """Plan the task before its clock starts; nothing of that where a plan was logged."""
        return self._now.prepare(state, seconds=seconds)

    def update(self, state: TaskState, *, shown: bool = True) -> Route:
        """The route for the task as it is now."""
        return self._now.update(state, shown=shown)

    def poll(self, state: TaskState) -> Route | None:
        """A better route for the same task, if one was found meanwhile."""
        return self._now.poll(state)

    def go_live(self, state: TaskState) -> None:
        """Plan live from now on, beginning with the route on show."""
        self._live.adopt(self.logged.update(state), state)
        self._live.replans = self.logged.replans
        self._now = self._live

    def close(self) -> None:
        """Stop planning in the background."""
        self._live.close()
