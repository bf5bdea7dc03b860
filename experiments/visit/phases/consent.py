"""Consent, before anything is recorded."""

from experiments.visit.phases.base import Again, Done, FormData, FormPhase, Visitor


class Consent(FormPhase):
    """A statement to agree with, or not."""

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:
        """Whether the person agrees; items of a study's own texts have to be answered besides."""
        if sent.get("agree") == "no":
            return Done({"agreed": False}, "no_consent")
        if sent.get("agree") != "yes":
            return Again(self._plan.texts["common"]["required"])
        read = super().read(visitor, sent)
        return Done({"agreed": True, **read.answers}) if isinstance(read, Done) else read

    def example(self) -> dict[str, str]:
        return {"agree": "yes", **super().example()}
