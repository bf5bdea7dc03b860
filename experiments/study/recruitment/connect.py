"""Recruit and pay participants through CloudResearch Connect (API v1).

The platform's documentation covers only links and completion pages. The API calls are those that public
clients use to approve, reject and list assignments and to pay bonuses. Amounts are in US dollars.
"""

import re
from collections.abc import Mapping
from typing import Any

from experiments.study.file import Recruitment
from experiments.study.payments.platform import Order, Payer, secret
from experiments.visit.recruiter import Candidate, InvalidLink, Leaving, WayBack

PERSON, ASSIGNMENT, PROJECT = "participantId", "assignmentId", "projectId"
SITE, API = "https://connect.cloudresearch.com", "https://connect-api.cloudresearch.com"
KEY = "MJSIM_CONNECT_KEY"
_ID = re.compile(r"[0-9A-Za-z-]{4,64}")


class Connect:
    """A recruiter for projects on CloudResearch Connect."""

    platform = "connect"
    parameters: tuple[str, ...] = (PERSON, ASSIGNMENT, PROJECT)
    submission: tuple[str, ...] = (PERSON, ASSIGNMENT)
    has_time_limit = True
    embedded_by: tuple[str, ...] = ()

    def __init__(self, settings: Recruitment) -> None:
        self._code, self._project = settings.completed, settings.study_id
        self._site = (*settings.sites, SITE)[0]

    def arrive(self, query: Mapping[str, str]) -> Candidate | InvalidLink:
        ids = {name: query.get(name, "") for name in self.parameters}
        if bad := [name for name, value in ids.items() if not _ID.fullmatch(value)]:
            return InvalidLink(f"{bad[0]} is missing or is no id")
        if self._project and ids[PROJECT] != self._project:
            return InvalidLink(f"{PROJECT} is not that of this study")
        return Candidate(ids[PERSON], ids)

    def way_back(self, how: Leaving, identity: Mapping[str, str]) -> WayBack:  # noqa: ARG002
        if how != "finished":
            return WayBack(gives_back=True)
        return WayBack(self._code, f"{self._site}/participant/project/{self._code}/complete")


class ConnectPayer(Payer):
    """A payment client for CloudResearch Connect, which pays the reward when an assignment is approved."""

    def __init__(self, settings: Recruitment) -> None:
        super().__init__(f"{settings.api_url or API}/api/v1", {"X-API-KEY": secret(KEY)})

    async def find(self, order: Order) -> str | None:
        """Look for a payment in the status of the assignment or in the sum of its bonuses."""
        listed = await self.ask("GET", f"/assignments/{order.id(PROJECT)}")
        mine: Mapping[str, Any] = next(
            (one for one in listed["assignments"] or () if one[ASSIGNMENT] == order.id(ASSIGNMENT)), {}
        )
        done = {"reward": "Approved", "rejection": "Rejected"}.get(order.kind)
        if done is not None:
            return done.lower() if mine.get("status") == done else None
        paid = round(100 * mine.get("bonus", 0.0))
        return "listed with the assignment" if paid >= sum(order.others) + order.cents else None

    async def send(self, order: Order) -> str:
        """Approve or reject an assignment, or pay a bonus. The platform accepts each token only once."""
        action = {"reward": "approve", "rejection": "reject"}.get(order.kind, "bonus")
        row = {"id": order.id(ASSIGNMENT), "message": order.why}
        body: Mapping[str, Any] = {"participants": [row]}
        if action == "bonus":
            body = {"bonusPayment": [{**row, "amount": order.cents / 100}]}
        token = {"IDEMPOTENCY-TOKEN": f"{order.key}-{order.attempt}"}
        path = f"/assignments/{order.id(PROJECT)}/{action}"
        await self.ask("POST", path, json=body, headers=token)
        return action
