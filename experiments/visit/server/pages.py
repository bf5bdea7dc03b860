"""Render the HTML pages for phases, messages and the end of a visit."""

import re
from collections.abc import Mapping
from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from experiments.visit.phases.base import Again
from experiments.visit.plan import CONSENT, PLAYED, VisitPlan
from experiments.visit.procedure import PhaseState
from experiments.visit.recruiter import Leaving
from experiments.visit.server.trials import Queued
from experiments.visit.store import PersonRow
from experiments.web.client_files import page


class VisitPages:
    """A renderer for pages that contain the texts of a study plan."""

    def __init__(self, plan: VisitPlan) -> None:
        self._plan, self._recruiter, self._steps = plan, plan.recruiter, len(plan.phases)

    def show(self, request: Request, template: str, status: int = 200, **values: Any) -> Response:
        """Render a template with the texts that all pages share."""
        section: Any = values.get("section")
        if "paragraphs" not in values:
            values["paragraphs"] = section.paragraphs()
        common, lang = self._plan.texts["common"], self._plan.language
        return page(request, template, status, common=common, lang=lang, **values)

    def message(self, request: Request, name: str, status: int = 200) -> Response:
        """Show a page with a message. `name` is the key of the message in the text files."""
        words = self._plan.texts["welcome"]
        heading = {"title": words[f"{name}_title"]}
        return self.show(request, "study", status, section=heading, paragraphs=[words[name]])

    def closed(self, request: Request, name: str) -> Response:
        """Show a message to a person who is not admitted. `name` is the key of the message in the text files."""
        remembers = self._recruiter.platform == "link"
        return self._last(request, "welcome", name, "withdrawn", "closed", remembers=remembers)

    def phase(
        self, request: Request, now: PhaseState, identity: Mapping[str, str], refused: Again | None = None
    ) -> Response:
        """Show the page of the participant's current phase, which must not be a trial."""
        if now.phase is None:
            return self.left(request, now.person)
        shown = now.phase.page(now.visitor, refused)
        if now.number < self._steps:
            return self.show(request, shown.template, **{**self._around(now), **shown.values})
        paragraphs = self._plan.texts[now.phase.name].paragraphs()
        values = {**shown.values, "paragraphs": paragraphs, "completion": self._plan.texts["completion"]}
        back = self._recruiter.way_back("finished", identity)
        return self.show(request, shown.template, **values, back=back, finished=True)

    def queue(self, request: Request, now: PhaseState, queued: Queued) -> Response:
        """Show the queue page, which reloads itself periodically."""
        section = self._plan.texts["queue"]
        values = {"place": str(queued.position), "wait": str(max(1, round(queued.wait / 60.0)))}
        texts = [*section.paragraphs(), *section.paragraphs("time_limit")[: self._recruiter.has_time_limit]]
        filled = [re.sub(r"\{(place|wait)\}", lambda found: values[found[1]], text) for text in texts]
        around = {**self._around(now), "section": section, "paragraphs": []}
        return self.show(request, "queue", **around, texts=filled, refresh=round(queued.refresh))

    def _around(self, now: PhaseState) -> dict[str, Any]:
        common, name = self._plan.texts["common"], now.phase.name if now.phase else ""
        step = common["step"].replace("{step}", str(now.number))
        section = self._plan.texts.get(name)
        return {
            "step": step.replace("{steps}", str(self._steps)),
            "number": now.number,
            "steps": self._steps,
            "path": now.visitor.path,
            "phase": name,
            "wait": now.wait,
            "optional": name in self._plan.optional,
            "leave": name != CONSENT,
            "paragraphs": section.paragraphs() if section else [],
            "story_title": self._plan.texts["story"]["title"],
        }

    def left(self, request: Request, person: PersonRow) -> Response:
        """Show the last page to a participant who did not finish."""
        names: Mapping[str, tuple[str, str, Leaving]] = {
            "no_consent": ("consent", "declined", "no_consent"),
            "withdrawn": ("withdrawal", "left", "withdrawn"),
            "screened_out": (person.phase, "failed", "screened_out"),
        }
        if person.status == "screened_out" and person.phase in PLAYED:
            return self._last(request, "welcome", "no_place", "screened_out")
        section, text, how = names.get(person.status, ("welcome", "timed_out", "timed_out"))
        return self._last(request, section, text, how)

    def _last(
        self,
        request: Request,
        section: str,
        text: str,
        how: Leaving,
        template: str = "completion",
        **values: Any,
    ) -> Response:
        words = self._plan.texts[section]
        return self.show(
            request,
            template,
            section={"title": words[f"{text}_title"]},
            paragraphs=[words[text]],
            completion=self._plan.texts["completion"],
            back=self._recruiter.way_back(how, {}),
            **values,
        )
