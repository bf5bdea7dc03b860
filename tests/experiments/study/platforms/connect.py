"""Plays CloudResearch Connect: the page of completion, and the part of API v1 that is used."""

from collections import Counter

from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from tests.experiments.study.platforms.emulator import SECRET, Emulator, page

PROJECT = "0123456789ABCDEF"
STATUSES = {"approve": "Approved", "reject": "Rejected"}


class Connect(Emulator):
    """A project of the platform.

    Attributes:
        assignments: By id: `participantId`, `status`, and `bonus`, dollars.
    """

    variable = "MJSIM_CONNECT_KEY"

    def __init__(self):
        super().__init__()
        self.assignments, self._tokens, self._bonuses = {}, set(), Counter()

    def routes(self):
        return [
            Route("/participant/project/{code}/complete", self.complete),
            Route("/api/v1/assignments/{project}", self.list),
            Route("/api/v1/assignments/{project}/{action}", self.act, methods=["POST"]),
        ]

    def is_api(self, scope):
        return scope["path"].startswith("/api/")

    def moves_money(self, scope):
        return scope["method"] == "POST"

    def allowed(self, headers):
        return headers.get("x-api-key") == SECRET

    def add(self, number, status="Pending"):
        """Somebody who took part; the ids."""
        ids = {"participantId": f"P{number:05}", "assignmentId": f"A{number:05}", "projectId": PROJECT}
        row = {"participantId": ids["participantId"], "status": status, "bonus": 0.0}
        self.assignments[ids["assignmentId"]] = row
        return ids

    def paid(self):
        """How often each assignment was paid each amount; `approved` stands for the reward."""
        approved = [name for name, row in self.assignments.items() if row["status"] == "Approved"]
        return self._bonuses + Counter((name, "approved") for name in approved)

    async def complete(self, _):
        return page("Project completed", "")

    async def list(self, request):
        if request.path_params["project"] != PROJECT:
            return JSONResponse({"error": {"title": "Bad Request"}}, 400)
        rows = [{"assignmentId": name, **row} for name, row in self.assignments.items()]
        return JSONResponse({"assignments": rows})

    async def act(self, request):
        body, token = await request.json(), request.headers["idempotency-token"]
        if token in self._tokens:
            return JSONResponse({"error": {"title": "Conflict"}}, 409)
        self._tokens.add(token)
        action = request.path_params["action"]
        for row in body["bonusPayment" if action == "bonus" else "participants"]:
            mine = self.assignments[row["id"]]
            if action == "bonus":
                mine["bonus"] += row["amount"]
                self._bonuses[row["id"], round(100 * row["amount"])] += 1
            elif mine["status"] != "Pending":
                return JSONResponse({"error": {"detail": f"{row['id']} is {mine['status']}"}}, 400)
            else:
                mine["status"] = STATUSES[action]
        return Response()
