from .phases.base import (
    Again as Again,
    Done as Done,
    FormData as FormData,
    FormPhase as FormPhase,
    Page as Page,
    Phase as Phase,
    Visitor as Visitor,
)
from .plan import VisitPlan as VisitPlan
