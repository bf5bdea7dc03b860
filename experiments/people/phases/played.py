"""A phase that is played: its page is that of `mjsim play`, and it ends when the trial does."""

from experiments.people.phases.base import Again, Done, FormData, Page, Visitor
from experiments.people.study_file import Study


class Played:
    """A trial."""

    def __init__(self, study: Study, name: str) -> None:
        self.name = name
        self._study = study

    def page(self, visitor: Visitor, refused: Again | None = None) -> Page:  # noqa: ARG002 - nothing is sent
        """The page of a trial; the server adds its settings."""
        return Page("play", {"trial": self.name})

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:  # noqa: ARG002 - it ends by itself
        """Nothing ends it but the trial's end."""
        return Again(self._study.texts["common"]["too_early"])
