"""Progress as lines of text, for output that is not a terminal."""

from typing import Any

from rich.progress import Progress, TaskID

INTERVAL_S = 5.0  # minimum time between two lines, in seconds


class ProgressLines(Progress):
    """Progress as lines of text instead of bars. An update prints a line if the last line is old enough."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(disable=True, **settings)
        self._printed = self.get_time()

    def update(self, task_id: TaskID, **changes: Any) -> None:
        super().update(task_id, **changes)
        self._print(task_id)

    def advance(self, task_id: TaskID, advance: float = 1) -> None:
        super().advance(task_id, advance)
        self._print(task_id)

    def _print(self, task_id: TaskID) -> None:
        now, task = self.get_time(), self._tasks[task_id]
        if now < self._printed + INTERVAL_S or not task.visible:
            return
        self._printed = now
        done = "" if task.total is None else f": {task.completed:.0f} of {task.total:.0f}"
        self.console.print(
            f"{task.description}{done} after {task.elapsed:.0f} s", markup=False, soft_wrap=True
        )
