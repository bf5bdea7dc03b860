"""One participant's visit: plan, phases, server and store."""

from typing import TYPE_CHECKING

from mjsim.support.lazy_names import lazy_names

__all__ = ["Again", "Done", "FormData", "FormPhase", "Page", "Phase", "VisitPlan", "Visitor"]

if TYPE_CHECKING:
    from experiments.visit.phases.base import Again, Done, FormData, FormPhase, Page, Phase, Visitor
    from experiments.visit.plan import VisitPlan
else:  # hidden from type checkers, which would otherwise accept any name
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "phases.base": ("Again", "Done", "FormData", "FormPhase", "Page", "Phase", "Visitor"),
            "plan": ("VisitPlan",),
        },
    )
