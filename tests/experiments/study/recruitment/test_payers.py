"""Payments through platforms: which requests are sent for each kind of payment, and which ones are found again."""

import asyncio
import json

import pytest

from experiments.study.file import Recruitment
from experiments.study.payments.platform import DeclinedError, Order, UnsureError
from experiments.study.recruitment.connect import ConnectPayer
from experiments.study.recruitment.external_question import ExternalQuestionPayer
from experiments.study.recruitment.prolific import ProlificPayer

SETTINGS = Recruitment(api_url="https://api.example.org", screened_out="0UT")
IDS = {
    "PROLIFIC_PID": "anna", "STUDY_ID": "study", "SESSION_ID": "session",
    "participantId": "anna", "assignmentId": "a1", "projectId": "project", "workerId": "anna", "hitId": "hit",
}  # fmt: skip


class Api:
    """A platform that answers with scripted values and keeps the requests."""

    def __init__(self, *answers):
        self.answers, self.requests = list(answers), []

    async def ask(self, method, path, **request):
        self.requests.append((method, path, request))
        answer = self.answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer


def payer(kind, monkeypatch, *answers):
    for name in ("PROLIFIC_TOKEN", "CONNECT_KEY", "EXTERNAL_QUESTION_TOKEN"):
        monkeypatch.setenv(f"MJSIM_{name}", "secret")
    found = kind(SETTINGS)
    asyncio.run(found.close())
    api = Api(*answers)
    monkeypatch.setattr(found, "ask", api.ask)
    return found, api


def order(kind, cents=250, others=()):
    return Order("study-p1-x", 2, kind, cents, "because", IDS, others)


def test_prolific_changes_the_status_of_a_submission_for_a_reward_a_screen_out_and_a_rejection(monkeypatch):
    for kind, change, status in (
        ("reward", {"action": "APPROVE"}, "APPROVED"),
        ("screen_out", {"action": "COMPLETE", "completion_code": "0UT"}, "SCREENED OUT"),
        ("rejection", {"action": "REJECT", "message": "because", "rejection_category": "OTHER"}, "REJECTED"),
    ):
        prolific, api = payer(ProlificPayer, monkeypatch, {"status": status})
        assert asyncio.run(prolific.send(order(kind))) == status.lower()
        assert api.requests == [("POST", "/submissions/session/transition/", {"json": change})]
        for found in (status, "AWAITING REVIEW"):
            prolific, api = payer(ProlificPayer, monkeypatch, {"status": found})
            reference = status.lower() if found == status else None
            assert asyncio.run(prolific.find(order(kind))) == reference
            assert api.requests == [("GET", "/submissions/session/", {})]


@pytest.mark.parametrize("kind", ["bonus", "partial"])
def test_prolific_prepares_a_bonus_and_then_pays_it(monkeypatch, kind):
    prolific, api = payer(ProlificPayer, monkeypatch, {"id": "b7"}, None)
    assert asyncio.run(prolific.send(order(kind, 5))) == "bonus b7"
    assert api.requests == [
        (
            "POST",
            "/submissions/bonus-payments/",
            {"json": {"study_id": "study", "csv_bonuses": "session,0.05"}},
        ),
        ("POST", "/bulk-bonus-payments/b7/pay/", {}),
    ]
    prolific, _ = payer(ProlificPayer, monkeypatch, UnsureError("lost"))
    with pytest.raises(DeclinedError, match="the bonus could not be prepared: lost"):
        asyncio.run(prolific.send(order(kind)))
    prolific, _ = payer(ProlificPayer, monkeypatch, {"id": "b7"}, UnsureError("lost"))
    with pytest.raises(UnsureError):
        asyncio.run(prolific.send(order(kind)))


@pytest.mark.parametrize(
    ("listed", "others", "found"),
    [
        (None, (), False),
        ([], (), False),
        ([250], (), True),
        ([250.0000001], (), True),
        ([249], (), False),
        ([250], (250,), False),
        ([250, 250], (250,), True),
        ([250, 100], (100,), True),
        ([100], (100,), False),
    ],
)
def test_prolific_lists_a_bonus_more_often_than_those_that_were_paid_before(
    monkeypatch, listed, others, found
):
    prolific, _ = payer(ProlificPayer, monkeypatch, {"status": "APPROVED", "bonus_payments": listed})
    reference = "listed with the submission" if found else None
    assert asyncio.run(prolific.find(order("bonus", others=others))) == reference


@pytest.mark.parametrize(
    ("kind", "action"),
    [("reward", "approve"), ("rejection", "reject"), ("bonus", "bonus"), ("partial", "bonus")],
)
def test_connect_names_each_attempt_so_that_it_is_carried_out_once(monkeypatch, kind, action):
    connect, api = payer(ConnectPayer, monkeypatch, None)
    assert asyncio.run(connect.send(order(kind))) == action
    row = {"id": "a1", "message": "because"}
    body = {"bonusPayment": [{**row, "amount": 2.5}]} if action == "bonus" else {"participants": [row]}
    headers = {"IDEMPOTENCY-TOKEN": "study-p1-x-2"}
    assert api.requests == [("POST", f"/assignments/project/{action}", {"json": body, "headers": headers})]


@pytest.mark.parametrize(
    ("kind", "mine", "others", "found"),
    [
        ("reward", {"status": "Approved"}, (), "approved"),
        ("reward", {"status": "Submitted"}, (), None),
        ("reward", None, (), None),
        ("rejection", {"status": "Rejected"}, (), "rejected"),
        ("bonus", {"status": "Approved", "bonus": 2.5}, (), "listed with the assignment"),
        ("bonus", {"status": "Approved", "bonus": 2.49}, (), None),
        ("bonus", {"status": "Approved", "bonus": 2.5}, (100,), None),
        ("bonus", {"status": "Approved", "bonus": 3.5}, (100,), "listed with the assignment"),
        ("bonus", {"status": "Approved"}, (), None),
        ("bonus", None, (), None),
    ],
)
def test_connect_lists_the_status_and_the_sum_of_bonuses_of_an_assignment(
    monkeypatch, kind, mine, others, found
):
    rows = [{"assignmentId": "other", "status": "Approved", "bonus": 99.0}]
    rows += [] if mine is None else [{"assignmentId": "a1", **mine}]
    connect, api = payer(ConnectPayer, monkeypatch, {"assignments": rows})
    assert asyncio.run(connect.find(order(kind, others=others))) == found
    assert api.requests == [("GET", "/assignments/project", {})]
    empty, _ = payer(ConnectPayer, monkeypatch, {"assignments": None})
    assert asyncio.run(empty.find(order(kind, others=others))) is None


@pytest.mark.parametrize(
    ("kind", "operation", "reference"),
    [
        ("reward", "ApproveAssignment", "approved"),
        ("rejection", "RejectAssignment", "rejected"),
        ("bonus", "SendBonus", "bonus"),
        ("partial", "SendBonus", "bonus"),
    ],
)
def test_an_external_platform_receives_an_operation_for_each_payment(monkeypatch, kind, operation, reference):
    external, api = payer(ExternalQuestionPayer, monkeypatch, {})
    assert asyncio.run(external.send(order(kind))) == reference
    ((method, path, request),) = api.requests
    assert (method, path) == ("POST", "/")
    assert request["headers"]["X-Amz-Target"].endswith(f".{operation}")
    expected = {"AssignmentId": "a1", "RequesterFeedback": "because"}
    if operation == "SendBonus":
        expected = {
            "AssignmentId": "a1", "WorkerId": "anna", "BonusAmount": "2.50",
            "Reason": "because (study-p1-x)", "UniqueRequestToken": "study-p1-x",
        }  # fmt: skip
    assert json.loads(request["content"]) == expected
    broken, _ = payer(ExternalQuestionPayer, monkeypatch, "text")
    with pytest.raises(UnsureError, match="no JSON"):
        asyncio.run(broken.send(order(kind)))


@pytest.mark.parametrize(
    ("kind", "answer", "found"),
    [
        ("reward", {"Assignment": {"AssignmentStatus": "Approved"}}, "approved"),
        ("reward", {"Assignment": {"AssignmentStatus": "Submitted"}}, None),
        ("rejection", {"Assignment": {"AssignmentStatus": "Rejected"}}, "rejected"),
        ("bonus", {"BonusPayments": [{"Reason": "because (study-p1-x)"}]}, "bonus"),
        ("bonus", {"BonusPayments": [{"Reason": "because (study-p1-xy)"}, {"Reason": "study-p1-x"}]}, None),
        ("bonus", {"BonusPayments": []}, None),
    ],
)
def test_an_external_platform_lists_the_status_and_the_reasons_of_bonuses(monkeypatch, kind, answer, found):
    external, api = payer(ExternalQuestionPayer, monkeypatch, answer)
    assert asyncio.run(external.find(order(kind))) == found
    operation = "ListBonusPayments" if kind == "bonus" else "GetAssignment"
    assert api.requests[0][2]["headers"]["X-Amz-Target"].endswith(f".{operation}")
    assert json.loads(api.requests[0][2]["content"])["AssignmentId"] == "a1"
