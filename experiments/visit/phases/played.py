"""The phases that are trials."""

from experiments.visit.phases.base import Again, Done, FormData, Page, Visitor
from experiments.visit.plan import VisitPlan


class Played:
    """A phase that is a trial. The server makes its page, and it ends with the trial."""

    def __init__(self, plan: VisitPlan, name: str) -> None:
        self.name = name
        self._plan = plan

    def page(self, visitor: Visitor, refused: Again | None = None) -> Page:  # noqa: ARG002 - nothing is sent
        return Page("play", {"trial": self.name})

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:  # noqa: ARG002 - it ends by itself
        return Again(self._plan.texts["common"]["too_early"])
