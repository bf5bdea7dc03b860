"""Plays the paper's pipeline of Mechanical Turk: preview, accept, submit in a frame, then approval and bonus."""

import json
from collections import Counter
from urllib.parse import parse_qsl, urlencode

from starlette.responses import JSONResponse
from starlette.routing import Route

from tests.experiments.study.platforms.emulator import SECRET, Emulator, page

TASK = "HIT0000001"
FRAME = '<iframe title="The task" src="{url}" width="1200" height="800"></iframe>'
ACCEPT = '<form method="post" action="/accept/{person}"><button>Accept</button></form>'
STATUSES = {"ApproveAssignment": "Approved", "RejectAssignment": "Rejected"}


class ExternalQuestion(Emulator):
    """A task (HIT) of the platform.

    Attributes:
        study_url: What it shows in its frame.
        assignments: By id: `worker`, `status`, and the `fields` of the form that ended it.
    """

    variable = "MJSIM_EXTERNAL_QUESTION_TOKEN"

    def __init__(self):
        super().__init__()
        self.study_url, self.assignments, self._bonuses = "", {}, []

    def routes(self):
        return [
            Route("/preview/{person}", self.preview),
            Route("/accept/{person}", self.accept, methods=["POST"]),
            Route("/return/{person}", self.give_back),
            Route("/mturk/externalSubmit", self.submit, methods=["POST"]),
            Route("/", self.operate, methods=["POST"]),
        ]

    def is_api(self, scope):
        return scope["path"] == "/"

    def moves_money(self, scope):
        target = dict(scope["headers"])[b"x-amz-target"]
        return target.endswith((b"Assignment", b"SendBonus")) and b"Get" not in target

    def allowed(self, headers):
        return headers.get("authorization") == f"Bearer {SECRET}"

    def add(self, number, status="Submitted"):
        """Somebody who accepted the task; the ids."""
        name = f"ASSIGNMENT{number:04}X{len(self.assignments)}"
        self.assignments[name] = {"worker": f"A{number:09}", "status": status, "fields": {}}
        return {
            "assignmentId": name,
            "hitId": TASK,
            "workerId": f"A{number:09}",
            "turkSubmitTo": self.url,
        }

    def paid(self):
        """How often each assignment was paid each amount; `approved` stands for the reward."""
        approved = [name for name, row in self.assignments.items() if row["status"] == "Approved"]
        bonuses = [(row["AssignmentId"], round(100 * float(row["BonusAmount"]))) for row in self._bonuses]
        return Counter(bonuses) + Counter((name, "approved") for name in approved)

    async def preview(self, request):
        ids = {"assignmentId": "ASSIGNMENT_ID_NOT_AVAILABLE", "hitId": TASK}
        accept = ACCEPT.format(person=request.path_params["person"])
        return page("A task to be looked at", accept + self._frame(ids))

    async def accept(self, request):
        return page("A task", self._frame(self.add(int(request.path_params["person"]), "Accepted")))

    async def give_back(self, request):
        """The person gives the task back, and may accept it again."""
        worker = f"A{int(request.path_params['person']):09}"
        self.assignments = {n: row for n, row in self.assignments.items() if row["worker"] != worker}
        return page("You returned the task", "")

    async def submit(self, request):
        fields = dict(parse_qsl((await request.body()).decode()))
        row = self.assignments.get(fields.pop("assignmentId", ""))
        if row is None or row["status"] != "Accepted":
            return page("There is no such task", "")
        row.update(status="Submitted", fields=fields)
        return page("The task has been submitted", "")

    async def operate(self, request):
        body = json.loads(await request.body())
        operation = request.headers["x-amz-target"].partition(".")[2]
        row = self.assignments.get(body["AssignmentId"])
        if row is None:
            return JSONResponse({"__type": "RequestError", "Message": "does not exist"}, 400)
        if operation == "GetAssignment":
            return JSONResponse({"Assignment": {"AssignmentStatus": row["status"]}})
        if operation == "ListBonusPayments":
            mine = [bonus for bonus in self._bonuses if bonus["AssignmentId"] == body["AssignmentId"]]
            return JSONResponse({"NumResults": len(mine), "BonusPayments": mine})
        if operation == "SendBonus":
            tokens = [bonus["UniqueRequestToken"] for bonus in self._bonuses]
            if body["UniqueRequestToken"] in tokens or row["status"] not in ("Submitted", "Approved"):
                return JSONResponse({"__type": "RequestError", "Message": "refused"}, 400)
            self._bonuses.append(body)
            return JSONResponse({})
        if row["status"] != "Submitted":
            return JSONResponse({"__type": "RequestError", "Message": f"status {row['status']}"}, 400)
        row["status"] = STATUSES[operation]
        return JSONResponse({})

    def _frame(self, ids):
        return FRAME.format(url=f"{self.study_url}?{urlencode({**ids, 'turkSubmitTo': self.url})}")
