"""Recruit and pay participants through the ExternalQuestion interface of Mechanical Turk.

The platform embeds the study in a frame and receives a form at the end. Mechanical Turk closed on 2026-09-30.
For other platforms with this interface, set `sites` and `api_url` in the study file. Requests follow the API
of Mechanical Turk (2017-01-17) as JSON, with a secret in the `Authorization` header instead of a signature.
"""

import json
import re
from collections.abc import Mapping
from typing import Any

from experiments.errors import ConfigError
from experiments.study.file import Recruitment
from experiments.study.payments.platform import Order, Payer, UnsureError, secret
from experiments.visit.recruiter import Candidate, InvalidLink, Leaving, Preview, WayBack

ASSIGNMENT, TASK, PERSON, SITE = "assignmentId", "hitId", "workerId", "turkSubmitTo"
PREVIEW = "ASSIGNMENT_ID_NOT_AVAILABLE"
SUBMIT = "/mturk/externalSubmit"
TOKEN = "MJSIM_EXTERNAL_QUESTION_TOKEN"
OPERATIONS = "MTurkRequesterServiceV20170117"
_ID = re.compile(r"[0-9A-Za-z]{4,64}")


class ExternalQuestion:
    """A recruiter for tasks (HITs) on platforms that embed the study in their pages."""

    platform = "external-question"
    parameters: tuple[str, ...] = (ASSIGNMENT, TASK, PERSON, SITE)
    submission: tuple[str, ...] = (PERSON, ASSIGNMENT)
    has_time_limit = True

    def __init__(self, settings: Recruitment) -> None:
        self.embedded_by, self._task = settings.sites, settings.study_id

    def arrive(self, query: Mapping[str, str]) -> Candidate | Preview | InvalidLink:
        """Validate the link of an arriving participant. It must name one of the `sites` in the study file."""
        if query.get(ASSIGNMENT) == PREVIEW:
            return Preview()
        ids = {name: query.get(name, "") for name in self.parameters}
        ids[SITE] = ids[SITE].rstrip("/")
        if bad := [name for name in (ASSIGNMENT, TASK, PERSON) if not _ID.fullmatch(ids[name])]:
            return InvalidLink(f"{bad[0]} is missing or is no id")
        if ids[SITE] not in self.embedded_by:
            return InvalidLink(f"{SITE} is not among study.recruitment.sites")
        if self._task and ids[TASK] != self._task:
            return InvalidLink(f"{TASK} is not that of this study")
        return Candidate(ids[PERSON], ids)

    def way_back(self, how: Leaving, identity: Mapping[str, str]) -> WayBack:
        site = identity.get(SITE, "")
        if how != "finished" or site not in self.embedded_by:
            return WayBack(gives_back=True)
        return WayBack(url=f"{site}{SUBMIT}", fields={ASSIGNMENT: identity[ASSIGNMENT], "study": "finished"})


class ExternalQuestionPayer(Payer):
    """A payment client for platforms that pay the reward of a task when the assignment is approved."""

    def __init__(self, settings: Recruitment) -> None:
        if not settings.api_url:
            raise ConfigError("study.recruitment.api_url is empty; set it to where the platform's API is")
        headers = {
            "Authorization": f"Bearer {secret(TOKEN)}",
            "Content-Type": "application/x-amz-json-1.1",
        }
        super().__init__(settings.api_url, headers)

    async def find(self, order: Order) -> str | None:
        """Look for a payment in the status of the assignment, or for its key in the reasons for bonuses."""
        mine = {"AssignmentId": order.id(ASSIGNMENT)}
        done = {"reward": "Approved", "rejection": "Rejected"}.get(order.kind)
        if done is not None:
            found = await self._ask("GetAssignment", mine)
            return done.lower() if found["Assignment"]["AssignmentStatus"] == done else None
        found = await self._ask("ListBonusPayments", {**mine, "MaxResults": 100})
        named = any(f"({order.key})" in bonus["Reason"] for bonus in found["BonusPayments"])
        return "bonus" if named else None

    async def send(self, order: Order) -> str:
        """Approve or reject an assignment, or pay a bonus. The platform pays only one bonus per token."""
        mine = {"AssignmentId": order.id(ASSIGNMENT)}
        if order.kind in ("reward", "rejection"):
            operation = "ApproveAssignment" if order.kind == "reward" else "RejectAssignment"
            await self._ask(operation, {**mine, "RequesterFeedback": order.why})
            return "approved" if order.kind == "reward" else "rejected"
        bonus = {
            **mine,
            "WorkerId": order.id(PERSON),
            "BonusAmount": order.amount,
            "Reason": f"{order.why} ({order.key})",
            "UniqueRequestToken": order.key,
        }
        await self._ask("SendBonus", bonus)
        return "bonus"

    async def _ask(self, operation: str, body: Mapping[str, Any]) -> Any:
        target = {"X-Amz-Target": f"{OPERATIONS}.{operation}"}
        answer = await self.ask("POST", "/", content=json.dumps(body), headers=target)
        if not isinstance(answer, dict):
            raise UnsureError("the platform's answer is no JSON")
        return answer
