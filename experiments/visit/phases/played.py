"""A phase that is played: its page is that of `mjsim play`, and it ends when the trial does."""

from experiments.visit.phases.base import Again, Done, FormData, Page, Visitor
from experiments.visit.plan import VisitPlan


class Played:
    """A trial."""

    def __init__(self, plan: VisitPlan, name: str) -> None:
        self.name = name
        self._plan = plan

    def page(self, visitor: Visitor, refused: Again | None = None) -> Page:  # noqa: ARG002 - nothing is sent
        """The page of a trial; the server adds its settings."""
        return Page("play", {"trial": self.name})

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:  # noqa: ARG002 - it ends by itself
        """Nothing ends it but the trial's end."""
        return Again(self._plan.texts["common"]["too_early"])
