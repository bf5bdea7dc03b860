from .phases.base import Again, Done, FormData, FormPhase, Page, Phase, Visitor
from .plan import VisitPlan

__all__ = ["Again", "Done", "FormData", "FormPhase", "Page", "Phase", "VisitPlan", "Visitor"]
