"""Check a rehearsal from outside: what is in its database, runs, tables and export, and whether they agree.

It reads the files by itself and shares no code with the package: `python check_rehearsal.py OUT` prints what is wrong.
"""

import csv
import hashlib
import itertools
import json
import sqlite3
import sys
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path

import pyarrow.parquet as parquet

ACTIVE = {"arrived", "assigned"}
ENDED = {  # statuses in the database of people by what they did; those who vanish are under way, or timed out
    "finished": {"finished"},
    "vanishes": {*ACTIVE, "timed_out"},
    "withdraws": {"withdrawn"},
    "withdraws and deletes": {"withdrawn"},
    "refuses": {"no_consent"},
    "fails": {"screened_out"},
}
REAL_TIME_EVERY = 20


def check(out):
    """Everything that is wrong with a rehearsal, a line each, and numbers to print."""
    return _Check(Path(out)).all()


class _Check:
    def __init__(self, out):
        self.out, self.served, self.wrong = out, out / "served", []
        self.plan = json.loads((out / "plan.json").read_text())
        self.did = {}
        for line in (out / "people.jsonl").read_text().splitlines():
            one = json.loads(line)
            self.did[one["number"]] = one
        base = sqlite3.connect(f"file:{self.served / 'study.db'}?mode=ro", uri=True)
        base.row_factory = sqlite3.Row
        self.rows = {
            name: [dict(row) for row in base.execute(f"SELECT * FROM {name} ORDER BY id")]
            for name in ("person", "identity", "assignment", "phase", "answer", "trial", "payment", "study")
        }
        base.close()
        self.person = {row["token_hash"]: row for row in self.rows["person"]}
        self.mine = {}
        for one in self.did.values():
            token = one["link"].rpartition("/")[2]
            self.mine[one["number"]] = self.person.get(hashlib.sha256(token.encode()).hexdigest())

    def all(self):
        self.people()
        self.places()
        self.phases()
        self.answers()
        self.trials()
        self.payments()
        self.tables()
        finished = Counter(row["cell"] for row in self.rows["assignment"] if row["state"] == "finished")
        return self.wrong, {
            "people": len(self.rows["person"]),
            "statuses": dict(Counter(row["status"] for row in self.rows["person"])),
            "rows": {name: len(rows) for name, rows in self.rows.items()},
            "finished by cell": dict(sorted(finished.items())),
        }

    def is_true(self, holds, text):
        if not holds:
            self.wrong.append(text)

    def of(self, table, person):
        return [row for row in self.rows[table] if row["person_id"] == person["id"]]

    def people(self):
        """Everybody of the plan is there once, marked, and in the status that follows from what they did."""
        self.is_true(len(self.did) == self.plan["people"], "not everybody of the plan came")
        self.is_true(len(self.rows["person"]) == len(self.did), "there are more or fewer people than came")
        for row in self.rows["person"]:
            self.is_true(row["platform"] == "rehearsal", f"person {row['id']} is not marked as a rehearsal")
        for number, one in self.did.items():
            person = self.mine[number]
            if person is None:
                self.wrong.append(f"person {number} is not in the database")
                continue
            wanted = ENDED.get(one["outcome"], {"?"})
            self.is_true(person["status"] in wanted, f"{number} {one['outcome']}: {person['status']}")
            deleted = bool(person["delete_wanted"])
            self.is_true(
                deleted == (one["outcome"] == "withdraws and deletes"), f"{number}: delete {deleted}"
            )

    def places(self):
        """Nobody shares a place; who finished has one that is finished, who left has none.

        A place that was given away while its person was away stays with the next one, even if both finish.
        """
        taken = Counter((r["cell"], r["place"]) for r in self.rows["assignment"] if r["state"] != "released")
        self.is_true(all(count == 1 for count in taken.values()), "two people have one place")
        status = {row["id"]: row["status"] for row in self.rows["person"]}
        for row in self.rows["assignment"]:
            finished = status[row["person_id"]] == "finished"
            given_away = row["state"] == "released" and taken[row["cell"], row["place"]] == 1
            self.is_true(
                (row["state"] == "finished") == finished or (finished and given_away),
                f"place of {row['person_id']}: {row['state']}",
            )
            left = status[row["person_id"]] in ("withdrawn", "screened_out", "no_consent", "timed_out")
            self.is_true(not (left and row["state"] == "held"), f"{row['person_id']} left and holds a place")
        orders = [row["order_seed"] for row in self.rows["assignment"]]
        self.is_true(len(set(orders)) == len(orders), "two people have one order")

    def phases(self):
        """Phases follow one another, each once, and all are over for who finished."""
        names = []
        for one in self.did.values():
            if one["outcome"] == "finished" and self.mine[one["number"]]:
                rows = self.of("phase", self.mine[one["number"]])
                names = names or [row["name"] for row in rows]
                self.is_true(
                    [row["name"] for row in rows] == names, f"{one['number']}: another order of phases"
                )
                self.is_true(all(row["ended"] for row in rows[:-1]), f"{one['number']}: a phase is not over")
        for person in self.rows["person"]:
            rows = self.of("phase", person)
            self.is_true(
                [row["name"] for row in rows] == names[: len(rows)] or not names, f"{person['id']}: phases"
            )
            for before, after in itertools.pairwise(rows):
                self.is_true(before["ended"] is not None, f"{person['id']}: {before['name']} is not over")
                self.is_true(
                    (before["ended"] or "") <= after["shown"],
                    f"{person['id']}: {after['name']} came too early",
                )

    def answers(self):
        """What was sent and accepted is final in the database, unless it was to be deleted."""
        for number, one in self.did.items():
            person = self.mine[number]
            if person is None:
                continue
            kept = {(row["phase"], row["item"]): row for row in self.of("answer", person)}
            if one["outcome"] == "withdraws and deletes":
                self.is_true(not kept, f"{number}: answers were not deleted")
                continue
            for phase, form in one["answers"].items():
                for item, value in form.items():
                    row = kept.get((phase, item))
                    if item in ("phase", "agree", "give_up") or (row is None and value in ("", [])):
                        continue
                    same = row is not None and row["final"] and _same(json.loads(row["value"]), value)
                    self.is_true(same, f"{number}: {phase}.{item} was {value!r}")

    def trials(self):
        """Each trial that is noted has its run, of the person's cell, marked; who finished has played all."""
        played = Counter(row["person_id"] for row in self.rows["trial"])
        most = max(played.values(), default=0)
        places = {row["person_id"]: row for row in self.rows["assignment"]}
        for person in self.rows["person"]:
            if person["status"] == "finished":
                self.is_true(played[person["id"]] == most, f"{person['id']} finished without playing")
            folder = self.served / "visits" / person["token_hash"]
            self.is_true(
                not (person["delete_wanted"] and folder.exists()), f"{person['id']}: runs were not deleted"
            )
        for row in self.rows["trial"]:
            run = self.served / row["folder"]
            if not run.is_dir():
                gone = next(p for p in self.rows["person"] if p["id"] == row["person_id"])["delete_wanted"]
                self.is_true(gone, f"{row['folder']} is missing")
                continue
            self.run(run, row, places[row["person_id"]])

    def run(self, run, row, place):
        events = [json.loads(line) for line in (run / "events.jsonl").read_text().splitlines()]
        metrics = json.loads((run / "metrics.json").read_text())
        self.is_true(metrics["ended"] == row["ended"] == "all delivered", f"{run}: ended {metrics['ended']}")
        self.is_true(metrics["delivered"] == metrics["objects"], f"{run}: not all was delivered")
        text = "\n".join(path.read_text() for path in sorted(run.glob("*.json")))
        self.is_true('"rehearsal"' in text, f"{run} is not marked as a rehearsal")
        if row["phase"] == "task":
            self.is_true(str(place["order_seed"]) in text, f"{run} has another order than its place")
        if row["person_id"] % REAL_TIME_EVERY == 0:
            started = next(event["wall"] for event in events if event["event"] == "started")
            noted = datetime.fromisoformat(row["finished"]).replace(tzinfo=UTC).timestamp()
            in_time = noted - started >= 0.9 * float(metrics["simulated_s"])
            self.is_true(in_time, f"{run} was not in real time")

    def payments(self):
        """One decision a person and kind; who finished gets the reward, who left early gets nothing."""
        keys = Counter((row["key"], row["event"]) for row in self.rows["payment"])
        self.is_true(all(count == 1 for count in keys.values()), "a payment was decided twice")
        self.is_true(all(row["event"] == "decided" for row in self.rows["payment"]), "somebody was paid")
        finished = {row["id"] for row in self.rows["person"] if row["status"] == "finished"}
        rewarded = {row["person_id"] for row in self.rows["payment"] if row["kind"] == "reward"}
        self.is_true(not rewarded or rewarded == finished, "the reward is not that of those who finished")

    def tables(self):
        """Tables have a row for each who played the task, with the answers of the database; so has the export."""
        kept = {row["id"] for row in self.rows["person"] if not row["delete_wanted"]}
        wanted = {row["person_id"] for row in self.rows["trial"] if row["phase"] == "task"} & kept
        table = parquet.read_table(self.out / "table" / "trials.parquet").to_pylist()
        self.is_true({int(row["participant"][1:]) for row in table} == wanted, "the table has other people")
        given = {
            (row["person_id"], row["item"]): row for row in self.rows["answer"] if row["phase"] == "survey"
        }
        for row in table:
            person = int(row["participant"][1:])
            self.is_true(
                row["user"] == "rehearsal" == row["platform"], f"p{person} is not marked in the table"
            )
            for name, value in row.items():
                if name.startswith("likert_"):
                    answer = given.get((person, name.removeprefix("likert_")))
                    found = json.loads(answer["value"]) if answer and answer["final"] else None
                    self.is_true(found == value, f"p{person}: {name} is {value}, and {found} in the database")
        export = self.out / "export"
        files = [path for path in export.rglob("*") if path.is_file()]
        main = next(
            path for path in files if path.name.endswith("_data.csv") and "_description" not in path.name
        )
        with main.open(newline="") as lines:
            exported = list(csv.DictReader(lines))
        self.is_true(
            len(exported) == len(table), f"the export has {len(exported)} rows, the table {len(table)}"
        )
        runs = sum(1 for _ in export.glob("runs/*/*/events.jsonl"))
        noted = sum(1 for row in self.rows["trial"] if row["person_id"] in kept)
        self.is_true(runs <= noted and runs >= len(table), f"the export has {runs} runs of {noted} trials")
        secrets = [row["token_hash"].encode() for row in self.rows["person"]]
        text = b"".join(
            path.read_bytes() for path in files if path.suffix in (".csv", ".json", ".jsonl", ".md")
        )
        self.is_true(not any(secret in text for secret in secrets), "the export has hashes of links")


def _same(kept, sent):
    if isinstance(kept, bool):
        return sent in (("yes", "true", "True") if kept else ("no", "false", "False"))
    if isinstance(kept, int | float):
        return float(sent) == kept
    return kept == sent


if __name__ == "__main__":
    wrong, numbers = check(sys.argv[1])
    for name, value in numbers.items():
        print(f"{name}: {value}")
    for line in wrong:
        print(f"WRONG: {line}")
    sys.exit(1 if wrong else 0)
