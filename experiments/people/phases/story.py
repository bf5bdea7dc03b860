"""The story of the task."""

from collections.abc import Mapping
from typing import Any

from experiments.people.phases.base import FormPhase, Visitor
from experiments.people.study_file import Study
from experiments.record.phases import STORY


class Story(FormPhase):
    """The text of the study's story file."""

    def values(self, visitor: Visitor) -> Mapping[str, Any]:  # noqa: ARG002 - the same for all
        """Its paragraphs."""
        return {"paragraphs": [part for part in self._study.story.split("\n\n") if part.strip()]}


def build(study: Study) -> Story:
    """The phase."""
    return Story(study, STORY)
