"""Recruit and pay participants through Prolific (API v1)."""

import re
from collections.abc import Mapping
from datetime import timedelta
from typing import Any
from urllib.parse import urlencode

from experiments.study.file import Recruitment
from experiments.study.payments.platform import DeclinedError, Order, Payer, UnsureError, secret
from experiments.visit.recruiter import Candidate, InvalidLink, Leaving, WayBack

PERSON, STUDY, SUBMISSION = "PROLIFIC_PID", "STUDY_ID", "SESSION_ID"
SITE, API = "https://app.prolific.com", "https://api.prolific.com"
TOKEN = "MJSIM_PROLIFIC_TOKEN"
_ID = re.compile(r"[0-9A-Za-z]{8,64}")


class Prolific:
    """A recruiter for studies on Prolific."""

    platform = "prolific"
    parameters: tuple[str, ...] = (PERSON, STUDY, SUBMISSION)
    submission: tuple[str, ...] = (PERSON, SUBMISSION)
    has_time_limit = True
    embedded_by: tuple[str, ...] = ()

    def __init__(self, settings: Recruitment) -> None:
        self._codes: Mapping[Leaving, str] = {
            "finished": settings.completed,
            "screened_out": settings.screened_out,
            "no_consent": settings.no_consent,
        }
        self._study = settings.study_id
        self._site = (*settings.sites, SITE)[0]

    def arrive(self, query: Mapping[str, str]) -> Candidate | InvalidLink:
        ids = {name: query.get(name, "") for name in self.parameters}
        if bad := [name for name, value in ids.items() if not _ID.fullmatch(value)]:
            return InvalidLink(f"{bad[0]} is missing or is no id")
        if self._study and ids[STUDY] != self._study:
            return InvalidLink(f"{STUDY} is not that of this study")
        return Candidate(ids[PERSON], ids)

    def way_back(self, how: Leaving, identity: Mapping[str, str]) -> WayBack:  # noqa: ARG002
        code = self._codes.get(how, "")
        if not code:
            return WayBack(gives_back=True)
        return WayBack(code, f"{self._site}/submissions/complete?{urlencode({'cc': code})}")


class ProlificPayer(Payer):
    """A payment client for Prolific, which pays the reward of a study when a submission is approved.

    The payment for screened-out participants is set on the platform. Partial payments are made as bonuses,
    which are possible even for returned submissions. The platform does not refuse duplicate bonuses. A retry
    therefore checks the submission's list of bonuses first, which is updated with a delay of some minutes.
    """

    listed_after = timedelta(hours=1)
    shortest_reason = 100

    def __init__(self, settings: Recruitment) -> None:
        super().__init__(f"{settings.api_url or API}/api/v1", {"Authorization": f"Token {secret(TOKEN)}"})
        self._screened_out = settings.screened_out

    async def find(self, order: Order) -> str | None:
        """Look for a payment in the status of the submission or in the amounts of its bonuses."""
        submission = await self.ask("GET", f"/submissions/{order.id(SUBMISSION)}/")
        done = {"reward": "APPROVED", "screen_out": "SCREENED OUT", "rejection": "REJECTED"}.get(order.kind)
        if done is not None:
            return done.lower() if submission["status"] == done else None
        listed = [round(cents) for cents in submission.get("bonus_payments") or ()]
        paid = listed.count(order.cents) > order.others.count(order.cents)
        return "listed with the submission" if paid else None

    async def send(self, order: Order) -> str:
        """Approve, reject or screen out a submission, or pay a bonus."""
        changes: Mapping[str, Mapping[str, str]] = {
            "reward": {"action": "APPROVE"},
            "screen_out": {"action": "COMPLETE", "completion_code": self._screened_out},
            "rejection": {"action": "REJECT", "message": order.why, "rejection_category": "OTHER"},
        }
        submission = order.id(SUBMISSION)
        if change := changes.get(order.kind):
            answer = await self.ask("POST", f"/submissions/{submission}/transition/", json=change)
            return str(answer["status"]).lower()
        bonus = await self._prepare(order)
        await self.ask("POST", f"/bulk-bonus-payments/{bonus}/pay/")
        return f"bonus {bonus}"

    async def _prepare(self, order: Order) -> str:
        row: Mapping[str, Any] = {
            "study_id": order.id(STUDY),
            "csv_bonuses": f"{order.id(SUBMISSION)},{order.amount}",
        }
        try:
            return str((await self.ask("POST", "/submissions/bonus-payments/", json=row))["id"])
        except UnsureError as error:
            raise DeclinedError(f"the bonus could not be prepared: {error}") from error
