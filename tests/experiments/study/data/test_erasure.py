"""Who is erased or forgotten leaves no trace: every byte of what is kept is searched."""

import asyncio
import datetime
import os
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from store_clock import at

from experiments.analysis.study.table import ANALYSIS, FILES, read_people
from experiments.cli.main import main
from experiments.errors import StoreError
from experiments.study.data import retention
from experiments.study.data.copies import note_copy
from experiments.study.data.retention import Retained, forget_old
from experiments.study.file import read_people_study
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from experiments.visit.folders import VisitFolders
from experiments.visit.store import Store, utc_now
from mjsim.support.files import WORK

PEOPLE = ("anna", "bert", "cleo")
TRACES = ("PID", "SUBMISSION", "key", "wrote")  # each with the name before it


@pytest.fixture(scope="module")
def runs(tmp_path_factory, house):
    folder = tmp_path_factory.mktemp("runs")
    for seed, name in enumerate(PEOPLE):
        config = TrialConfig(objects=1, assistance="optimal", seed=seed, fidelity="event", regret=False)
        run_trial(config, folder / name, topdown=False, house=house)
    return folder


@pytest.fixture
def served(tmp_path, runs):
    """A study with three people of a platform, a backup, a table and an export of it."""
    study = tmp_path / "study.toml"
    assert main(["study", "init", str(study)]) == 0
    study.write_text(study.read_text().replace("attempts = 3 ", "keep_days = 30\nattempts = 3 "))
    folder = tmp_path / "served"
    folder.mkdir()
    asyncio.run(_fill(read_people_study(study), folder, runs))
    names = [str(study), str(folder)]
    assert main(["study", "backup", *names, "--out", str(tmp_path / "backup.db")]) == 0
    assert main(["study", "collect", *names, "--out", str(tmp_path / "table")]) == 0
    assert main(["study", "export", *names, "--out", str(tmp_path / "export")]) == 0
    return names


async def _open(names):
    study = read_people_study(Path(names[0]))
    return await Store.open(f"sqlite:///{names[1]}/study.db", study.settings.name, study.sha256)


async def audit_log(names):
    store = await _open(names)
    try:
        return await store.audit_log()
    finally:
        await store.close()


async def _fill(study, folder, runs):
    store = await Store.open(f"sqlite:///{folder}/study.db", study.settings.name, study.sha256)
    for name in PEOPLE:
        ids = {"PROLIFIC_PID": f"{name}-PID" * 20, "SESSION_ID": f"{name}-SUBMISSION"}
        person = await store.arrive("prolific", f"{name}-key", ids, name[0] * 64, "consent")
        await store.show_phase(person.id, "consent")
        await store.finish_phase(person.id, "consent", "task", {"agreed": True})
        shutil.copytree(runs / name, folder / "visits" / (name[0] * 64) / "task")
        await store.finish_trial(person.id, "task", f"visits/{name[0] * 64}/task", "all delivered")
        await store.finish_phase(person.id, "task", "survey", {}, "all delivered")
        for draft in range(20):  # kept as they are given
            await store.save_answers(person.id, "survey", {"comments": f"{name}-wrote {draft} " * 50})
        answers = {"useful": 4, "comments": f"{name}-wrote " * 100}
        await store.finish_phase(person.id, "survey", "completion", answers, status="finished")
    await store.close()


def traces(folder, *wanted):
    """Files below a folder with any of these texts in their bytes or their path."""
    return [
        (str(path.relative_to(folder)), text)
        for path in folder.rglob("*")
        if path.is_file()
        for text in wanted
        if text.encode() in path.read_bytes() or text in str(path.relative_to(folder))
    ]


def test_who_is_erased_is_nowhere_any_more(served, tmp_path, capsys):
    gone = [f"bert-{trace}" for trace in TRACES] + ["b" * 64]
    assert {path for path, _ in traces(tmp_path, *gone)} >= {
        "backup.db",
        "served/study.db",
        "table/texts.csv",
    }
    assert (tmp_path / "export" / "runs" / "p00002").is_dir()
    capsys.readouterr()
    assert main(["study", "erase", *served, "p00002", "--who", "me"]) == 0
    said = capsys.readouterr().out
    assert all(f"{tmp_path / name} of " in said for name in ("backup.db", "table", "export"))
    assert traces(tmp_path, *gone) == []
    assert traces(tmp_path, "p00002") == []
    assert [row["participant"] for row in read_people(tmp_path / "table")] == ["p00001", "p00003"]
    assert {path.name for path in (tmp_path / "export" / "runs").iterdir()} == {"p00001", "p00003"}
    for others in ("anna-PID", "cleo-wrote"):
        assert {path for path, _ in traces(tmp_path, others)} >= {"backup.db", "served/study.db"}
    (tmp_path / "again").mkdir()
    assert main(["study", "restore", str(tmp_path / "backup.db"), str(tmp_path / "again" / "study.db")]) == 0


def test_nobody_is_erased_whose_runs_cannot_be_deleted(served, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(VisitFolders, "remove", lambda *_: None)
    assert main(["study", "erase", *served, "p00002", "--who", "me"]) == 2
    assert f"visits/{'b' * 64} cannot be deleted" in capsys.readouterr().err
    assert traces(tmp_path / "served", "bert-PID"), "the same command finishes it later"
    monkeypatch.undo()
    assert main(["study", "erase", *served, "p00002", "--who", "me"]) == 0
    assert traces(tmp_path, "bert-PID", "b" * 64) == []


def test_a_person_who_is_owed_money_is_paid_first_but_others_can_be_erased(served, tmp_path, capsys):
    async def decide():
        store = await _open(served)
        await store.ledger.decide(1, "reward", 750, "USD", "p00001-reward", "finished")
        await store.close()

    asyncio.run(decide())
    assert main(["study", "erase", *served, "p00001", "--who", "me"]) == 2
    assert "p00001 is owed p00001-reward: pay first, then erase" in capsys.readouterr().err
    assert traces(tmp_path / "served", "anna-PID") and traces(tmp_path / "table", "anna-wrote")
    assert main(["study", "erase", *served, "p00002", "--who", "me"]) == 0
    assert traces(tmp_path, "bert-PID") == []


def test_nothing_is_said_about_files_that_do_not_contain_the_person(served, tmp_path, capsys):
    async def arrive():
        store = await _open(served)
        await store.arrive("prolific", "dora-key", {"PROLIFIC_PID": "dora-PID"}, "d" * 64, "consent")
        await store.close()

    asyncio.run(arrive())
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "table").iterdir()}
    capsys.readouterr()
    assert main(["study", "erase", *served, "p00004", "--who", "me"]) == 0
    said = capsys.readouterr().out
    assert "was rewritten" not in said and "not on this machine" not in said
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "table").iterdir()} == before
    assert traces(tmp_path, "dora", "d" * 64) == []


def test_a_backup_in_which_a_payment_was_owed_is_changed_too(served, tmp_path):
    async def pay(*events):
        store = await _open(served)
        for event, *values in events:
            await getattr(store.ledger, event)(*values)
        await store.close()

    reward, bonus = "p00002-reward", "p00002-bonus"
    decided = [("decide", 2, "reward", 750, "USD", reward), ("decide", 2, "bonus", 100, "USD", bonus)]
    asyncio.run(pay(*decided, ("begin_sending", reward)))
    assert main(["study", "backup", *served, "--out", str(tmp_path / "owed.db")]) == 0
    asyncio.run(pay(("begin_sending", bonus), *(("confirm", key, 1, "a receipt") for key in (reward, bonus))))
    assert traces(tmp_path, "bert-PID")
    assert main(["study", "erase", *served, "p00002", "--who", "me"]) == 0
    assert traces(tmp_path, "bert-PID") == []


def test_films_of_a_person_are_deleted_although_they_do_not_contain_the_name(served, tmp_path, capsys):
    films = {name: tmp_path / f"{name}.mp4" for name in PEOPLE}
    for name, film in films.items():
        film.write_bytes(b"frames")
        note_copy(Path(served[1]), "film", film, source=f"visits/{name[0] * 64}/task")
    assert main(["study", "erase", *served, "p00002", "--who", "me"]) == 0
    assert f"{films['bert']} of " in capsys.readouterr().out
    assert [name for name, film in films.items() if film.exists()] == ["anna", "cleo"]
    assert main(["study", "erase", *served, "p00003", "--who", "me"]) == 0
    assert str(films["bert"]) not in capsys.readouterr().out, "the list of copies no longer contains the film"


def test_files_made_from_the_data_are_deleted_if_they_contain_the_person(served, tmp_path, capsys):
    folder, table = Path(served[1]), tmp_path / "table"
    # The list of copies in the study's folder does not contain the first analysis, as in earlier versions.
    mine = [folder / ANALYSIS / FILES[0], table / ANALYSIS / FILES[0], tmp_path / "mine.csv"]
    others = tmp_path / "others.csv"
    for path in (*mine, others):
        path.parent.mkdir(exist_ok=True)
        path.write_text("p00001" if path == others else f"p00001 {'b' * 64}")
    note_copy(table, "analysis", table / ANALYSIS)
    for path in (mine[2], others):
        note_copy(folder, "metrics", path)
    assert main(["study", "erase", *served, "p00002", "--who", "me"]) == 0
    said = capsys.readouterr().out
    assert all(f"{made} " in said for made in (folder / ANALYSIS, table / ANALYSIS, mine[2]))
    assert not any(path.exists() for path in mine)
    assert others.exists() and str(others) not in said


def test_files_that_a_killed_command_has_left_are_deleted(served, tmp_path):
    """A process with the first of these numbers cannot exist. The second process is still running."""
    lefts = {
        number: [place / f"{WORK}{number}-left" for place in (tmp_path, Path(served[1]))]
        for number in (99999999, os.getpid())
    }
    for left in (*lefts[99999999], *lefts[os.getpid()]):
        left.mkdir()
        (left / "texts.csv").write_text("bert-wrote")
        for path in (left / "texts.csv", left):
            os.utime(path, (0, 0))
    assert main(["study", "erase", *served, "p00002", "--who", "me"]) == 0
    assert not any(left.exists() for left in lefts[99999999])
    assert all((left / "texts.csv").exists() for left in lefts[os.getpid()])


def test_a_copy_that_was_moved_is_named(served, tmp_path, capsys):
    moved = [tmp_path / "backup.db", tmp_path / "runs.csv", tmp_path / "served" / "restored.db"]
    assert main(["study", "restore", str(moved[0]), str(moved[2])]) == 0
    assert main(["metrics", f"{served[1]}/visits/{'b' * 64}/task", "--out", str(moved[1])]) == 0
    for path in moved:
        path.rename(path.with_name(f"{path.name}-elsewhere"))
    visits = tmp_path / "served" / "visits"
    (visits / ("b" * 64)).rename(tmp_path / "another-host")
    capsys.readouterr()
    assert main(["study", "erase", *served, "p00002", "--who", "me"]) == 0
    said = capsys.readouterr().out
    for path in moved:
        (line,) = (line for line in said.splitlines() if f"{path} of " in line)
        assert "is missing; if it was moved, delete p00002 there" in line
    assert f"the runs of p00002 are not on this machine; delete visits/{'b' * 64}" in said


def test_another_person_with_the_same_number_stays_in_a_backup(served, tmp_path):
    """As after an older backup was restored and the study went on."""
    with closing(sqlite3.connect(tmp_path / "backup.db")) as database, database:
        database.execute("UPDATE person SET created = '2020-01-01 00:00:00.000000' WHERE id = 2")
    assert main(["study", "erase", *served, "p00002", "--who", "me"]) == 0
    with closing(sqlite3.connect(tmp_path / "backup.db")) as database:
        assert database.execute("SELECT count(*) FROM person WHERE id = 2").fetchone() == (1,)


def test_the_last_person_of_a_table_leaves_an_empty_one(served, tmp_path):
    for name in ("p00001", "p00002", "p00003"):
        assert main(["study", "erase", *served, name, "--who", "me"]) == 0
    assert not (tmp_path / "table" / "trials.parquet").exists()
    assert traces(tmp_path, *PEOPLE, "p00001", "p00003") == []


def test_a_backup_that_cannot_be_read_stops_erasing_before_anything_is_deleted(served, tmp_path):
    (tmp_path / "backup.db").write_bytes(b"no database" * 1000)
    assert main(["study", "erase", *served, "p00002", "--who", "me"]) == 2
    assert (tmp_path / "served" / "visits" / ("b" * 64)).is_dir()


def test_who_people_are_is_forgotten_by_date(served, tmp_path, capsys):
    async def forget(days, **options):
        store = await _open(served)
        try:
            if days == 31:
                await store.withdraw(3, delete=True)
                await store.ledger.decide(1, "reward", 750, "USD", "p00001-reward", "finished")
            later = utc_now() + datetime.timedelta(days=days)
            visits = tmp_path / "served" / "visits"
            with at(later):
                return await forget_old(store, visits, 30, **options)
        finally:
            await store.close()

    page = tmp_path / "page.html"
    page.write_text(f"visits/{'b' * 64}/task")
    note_copy(tmp_path / "served", "page", page)
    assert asyncio.run(forget(29)).forgotten == ()
    planned = asyncio.run(forget(31, dry=True))
    assert (planned.forgotten, planned.erased, planned.unpaid) == (("p00002",), ("p00003",), ("p00001",))
    assert traces(tmp_path / "served", "bert-PID") and page.exists()
    assert asyncio.run(forget(32)) == planned
    log = [(row.who, row.action, row.details) for row in asyncio.run(audit_log(served))]
    assert ("keep_days", "people forgotten", {"people": [2]}) in log
    assert ("keep_days", "person erased", {"person": 3, "paid": []}) in log
    assert traces(tmp_path, "bert-PID", "bert-SUBMISSION", "bert-key", "b" * 64) == []
    assert traces(tmp_path, *[f"cleo-{trace}" for trace in TRACES], "c" * 64) == []
    assert traces(tmp_path / "served", "anna-PID") and traces(tmp_path / "served", "bert-wrote")
    capsys.readouterr()
    assert main(["study", "collect", *served, "--out", str(tmp_path / "table"), "--force"]) == 0
    assert {row["participant"] for row in read_people(tmp_path / "table")} == {"p00001", "p00002"}
    assert main(["study", "forget", *served]) == 0
    lines = [f"{what}: no participant" for what in ("forgotten", "erased", "not paid yet")]
    assert capsys.readouterr().out.splitlines()[-3:] == lines


def test_a_host_forgets_participants_whose_runs_it_has_and_those_without_runs(served, tmp_path):
    visits = tmp_path / "served" / "visits"
    (visits / ("a" * 64)).rename(tmp_path / "another-host")
    with closing(sqlite3.connect(tmp_path / "served" / "study.db")) as database, database:
        database.execute("DELETE FROM trial WHERE person_id = 2")

    async def forget():
        store = await _open(served)
        try:
            with at(utc_now() + datetime.timedelta(days=31)):
                return await forget_old(store, visits, 30)
        finally:
            await store.close()

    assert asyncio.run(forget()).forgotten == ("p00002", "p00003")


def test_forgetting_that_was_interrupted_is_finished_later(served, tmp_path, monkeypatch):
    async def stopped(*_):
        raise KeyboardInterrupt

    async def forget():
        store = await _open(served)
        try:
            later = utc_now() + datetime.timedelta(days=31)
            with at(later):
                await forget_old(store, tmp_path / "served" / "visits", 30)
        finally:
            await store.close()

    with monkeypatch.context() as killed, pytest.raises(KeyboardInterrupt):
        killed.setattr(Store, "forget", stopped)
        asyncio.run(forget())
    asyncio.run(forget())
    assert traces(tmp_path, "a" * 64, "anna-PID") == []
    with closing(sqlite3.connect(tmp_path / "served" / "study.db")) as database:
        folders = [row[0] for row in database.execute("SELECT folder FROM trial")]
    assert len(folders) == 3 and all(
        (tmp_path / "served" / path / "events.jsonl").is_file() for path in folders
    )


def test_the_server_forgets_every_day(served, tmp_path, monkeypatch):
    times = iter([utc_now() + datetime.timedelta(days=days) for days in (29, 31, 32)])
    monkeypatch.setattr(retention, "utc_now", lambda: next(times))
    monkeypatch.setattr(retention, "DAY", 0.0)

    async def days():
        store = await _open(served)
        try:
            await retention.forget_daily(store, tmp_path / "served" / "visits", 30)
        finally:
            assert traces(tmp_path, "bert-PID", "b" * 64) == [], "while the server keeps the database open"
            await store.close()

    with pytest.raises((StopIteration, RuntimeError)):
        asyncio.run(days())
    assert traces(tmp_path, "bert-PID", "b" * 64) == []


def test_the_server_reports_what_it_forgot_and_tries_again_a_day_after_a_failure(monkeypatch, caplog):
    results = [
        StoreError("the database is locked"),
        OSError("the disk is full"),
        Retained(("p00001", "p00002"), (), ()),
        Retained((), ("p00003",), ()),
        Retained((), (), ("p00004",)),
    ]
    pauses = []

    async def forget(*_):
        result = results[len(pauses)]
        if isinstance(result, Exception):
            raise result
        return result

    async def sleep(seconds):
        pauses.append(seconds)
        if len(pauses) == len(results):
            raise asyncio.CancelledError

    monkeypatch.setattr(retention, "forget_old", forget)
    monkeypatch.setattr(retention.asyncio, "sleep", sleep)
    caplog.set_level("INFO", logger="mjsim.study")
    with pytest.raises(asyncio.CancelledError):
        asyncio.run(retention.forget_daily(None, Path("visits"), 30))
    assert caplog.messages == [
        "the database is locked",
        "the disk is full",
        "2 people forgotten, 0 erased",
        "0 people forgotten, 1 erased",
    ]
    assert pauses == [24 * 60 * 60] * len(results)
