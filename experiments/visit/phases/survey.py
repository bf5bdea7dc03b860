"""The survey: items on a scale, demographics, free text (PAPER section 6), and checks of attention."""

import dataclasses

from experiments.visit.phases.base import Again, Done, FormData, FormPhase, Visitor


class Survey(FormPhase):
    """Items; those with a right answer show whether they were read."""

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:
        """The answers; whoever gives too many wrong ones is screened out where the study file says so."""
        read = super().read(visitor, sent)
        allowed = self._plan.limits.inattentive
        if isinstance(read, Again) or allowed is None:
            return read
        wrong = sum(item.is_wrong(read.answers.get(item.name)) for item in self.items)
        return dataclasses.replace(read, outcome="screened_out") if wrong > allowed else read
