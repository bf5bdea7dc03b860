"""Whether the task was understood: questions with one right answer each, a number of attempts."""

from collections.abc import Mapping
from typing import Any

from experiments.visit.phases.base import Again, Done, FormData, FormPhase, Visitor


class Comprehension(FormPhase):
    """Questions about the story, which can be read again on the same page."""

    def values(self, visitor: Visitor) -> Mapping[str, Any]:  # noqa: ARG002 - the same for all
        return {"story": self._plan.story_paragraphs}

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:
        """The answers, if all are right; after the last attempt the person is screened out."""
        read = super().read(visitor, sent)
        if isinstance(read, Again):
            return read
        wrong = any(item.is_wrong(read.answers.get(item.name)) for item in self.items)
        answers = dict(read.answers)
        if not wrong:
            return Done(answers)
        if visitor.attempts + 1 >= self._plan.limits.attempts:
            return Done(answers, "screened_out")
        return Again(self.texts["wrong"], {"form": self._form(None, read.answers)})
