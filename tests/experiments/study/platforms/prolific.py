"""Plays Prolific: a page from which one takes part, the page of completion, and the part of API v1 that is used."""

from collections import Counter

from starlette.responses import JSONResponse, RedirectResponse
from starlette.routing import Route

from tests.experiments.study.platforms.emulator import SECRET, Emulator, page

STUDY = "study0000001"
CODES = {"C0MPLETE": "AWAITING REVIEW", "SCREEN0UT": "SCREENED OUT", "N0C0NSENT": "RETURNED"}
ACTIONS = {"APPROVE": "APPROVED", "REJECT": "REJECTED"}


class Prolific(Emulator):
    """A study of the platform.

    Attributes:
        study_url: Where people take part.
        submissions: By id: `participant`, `status` and `bonus_payments`, cents.
    """

    variable = "MJSIM_PROLIFIC_TOKEN"

    def __init__(self):
        super().__init__()
        self.study_url, self.submissions, self._prepared = "", {}, {}

    def routes(self):
        return [
            Route("/studies/{person}", self.offer),
            Route("/start/{person}", self.start),
            Route("/submissions/complete", self.complete),
            Route("/api/v1/submissions/bonus-payments/", self.prepare, methods=["POST"]),
            Route("/api/v1/bulk-bonus-payments/{bonus}/pay/", self.pay, methods=["POST"]),
            Route("/api/v1/submissions/{submission}/", self.get),
            Route("/api/v1/submissions/{submission}/transition/", self.transition, methods=["POST"]),
        ]

    def is_api(self, scope):
        return scope["path"].startswith("/api/")

    def moves_money(self, scope):
        return scope["path"].endswith(("/pay/", "/transition/"))

    def allowed(self, headers):
        return headers.get("authorization") == f"Token {SECRET}"

    def add(self, number, status="AWAITING REVIEW"):
        """Somebody who took part; the ids."""
        ids = {"PROLIFIC_PID": f"person{number:06}", "STUDY_ID": STUDY, "SESSION_ID": f"session{number:05}"}
        row = {"participant": ids["PROLIFIC_PID"], "status": status, "bonus_payments": []}
        self.submissions[ids["SESSION_ID"]] = row
        return ids

    def paid(self):
        """How often each submission was paid each amount; `approved` stands for the reward."""
        found = Counter()
        for name, row in self.submissions.items():
            found.update((name, round(cents)) for cents in row["bonus_payments"])
            if row["status"] == "APPROVED":
                found[name, "approved"] += 1
        return found

    async def offer(self, request):
        person = request.path_params["person"]
        return page("A study on Prolific", f'<p><a href="/start/{person}">Open study link</a></p>')

    async def start(self, request):
        ids = self.add(int(request.path_params["person"]), "ACTIVE")
        return RedirectResponse(f"{self.study_url}?{'&'.join(f'{k}={v}' for k, v in ids.items())}")

    async def complete(self, request):
        status = CODES.get(request.query_params["cc"])
        for row in self.submissions.values():
            if status and row["status"] == "ACTIVE":
                row["status"] = status
        return page("Submission received" if status else "Unknown code", "")

    async def get(self, request):
        name = request.path_params["submission"]
        if name not in self.submissions:
            return JSONResponse({"error": {"title": "Not found."}}, 404)
        return JSONResponse({"id": name, "study_id": STUDY, **self.submissions[name]})

    async def transition(self, request):
        row, body = self.submissions[request.path_params["submission"]], await request.json()
        by_code = body["action"] == "COMPLETE"
        status = CODES.get(body["completion_code"]) if by_code else ACTIONS.get(body["action"])
        if row["status"] not in ("AWAITING REVIEW", status) or status is None:
            return JSONResponse({"error": {"detail": f"not from {row['status']}"}}, 400)
        if body["action"] == "REJECT" and len(body["message"]) < 100:
            return JSONResponse({"error": {"detail": "the message is too short"}}, 400)
        row["status"] = status
        return JSONResponse({"status": status})

    async def prepare(self, request):
        body = await request.json()
        submission, amount = body["csv_bonuses"].split(",")
        if body["study_id"] != STUDY or submission not in self.submissions:
            return JSONResponse({"error": {"detail": f"unknown {submission}"}}, 400)
        bonus = f"bulk{len(self._prepared)}"
        self._prepared[bonus] = submission, round(100 * float(amount))
        return JSONResponse({"id": bonus}, 201)

    async def pay(self, request):
        """Pays again when it is asked again, as the platform does."""
        submission, cents = self._prepared[request.path_params["bonus"]]
        self.submissions[submission]["bonus_payments"].append(float(cents))
        return JSONResponse({"message": "in progress"}, 202)
