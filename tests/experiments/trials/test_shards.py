"""Shards share a design without gaps or overlaps, and merge into the folder that one machine makes."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.cli.main import main
from experiments.errors import ConfigError, RecordError
from experiments.record import records
from experiments.record.files import write_checksums
from experiments.trials import trial_reader
from experiments.trials.batch import run_batch
from experiments.trials.batch_folder import read_trial
from experiments.trials.design import Design, factorial
from experiments.trials.merge import merge_shards
from experiments.trials.shards import Shard, shard_numbers
from experiments.trials.table import read_rows
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig


def brief(seed, **options):
    same = {"objects": 1, "assistance": "none", "fidelity": "event", "regret": False, "time_limit": 0.2}
    return TrialConfig(**{**same, "seed": seed, **options})


SAME = {"fidelity": "event", "regret": False, "time_limit": 0.2}
DESIGN = factorial(objects=[1], assistance=["none", "optimal"], users=["follower"], seeds=range(5), **SAME)


@given(st.data())
def test_shards_are_disjoint_complete_and_balanced(data):
    houses = data.draw(st.lists(st.integers(0, 4), min_size=1, max_size=60))
    trials = [brief(k, house=f"generated:{house}") for k, house in enumerate(houses)]
    count = data.draw(st.integers(1, len(trials)))
    parts = [Shard(k, count).of(Design(tuple(trials))).trials for k in range(1, count + 1)]
    assert sorted((t for part in parts for t in part), key=trials.index) == trials
    assert max(map(len, parts)) - min(map(len, parts)) <= 1
    assert all(list(part) == sorted(part, key=trials.index) for part in parts)  # in the design's order
    assert sum(len({t.house for t in part}) for part in parts) <= len(set(houses)) + count - 1


def test_a_shard_depends_on_the_design_only_and_mixes_its_cells():
    trials = [brief(seed, objects=n) for n in (1, 2, 3, 4) for seed in range(30)]
    moved = [
        brief(seed, objects=n, house="/elsewhere/catalogue.toml") for n in (1, 2, 3, 4) for seed in range(30)
    ]
    numbers = shard_numbers(trials, 5)
    assert numbers == shard_numbers(moved, 5)
    assert numbers[:12] == [
        3,
        3,
        5,
        2,
        2,
        5,
        5,
        3,
        1,
        1,
        2,
        2,
    ]  # the same on every machine and in every version
    for shard in range(1, 6):
        assert {t.objects for t, n in zip(trials, numbers, strict=True) if n == shard} == {1, 2, 3, 4}


@pytest.mark.parametrize(
    "text", ["0/40", "41/40", "3/0", "0/0", "a/b", "3", "3/", "-1/4", "1/4/5", "1.5/4", "٣/٤"]
)
def test_what_is_not_a_shard_is_refused_with_a_hint(text, capsys):
    with pytest.raises(ConfigError, match="is not a shard K/N"):
        Shard.parse(text)
    with pytest.raises(SystemExit) as refused:
        main(["batch", f"--shard={text}", "--out", "nowhere"])
    assert refused.value.code == 2 and "is not a shard K/N" in capsys.readouterr().err
    assert not Path("nowhere").exists()


def test_more_shards_than_trials_are_refused():
    with pytest.raises(ConfigError, match="10 trials cannot be shared by 11 shards; use at most 10"):
        Shard(1, 11).of(DESIGN)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The folder of the design, run by one machine."""
    folder = tmp_path_factory.mktemp("whole") / "out"
    run_batch(DESIGN, folder, workers=1)
    return folder


def parts_of(whole, folder, count, shared=False):
    """Folders as shards leave them, made from the trials of `whole`."""
    parts = [folder / ("shared" if shared else f"part{k}") for k in range(1, count + 1)]
    for k, part in enumerate(parts, start=1):
        (part / "trials").mkdir(parents=True, exist_ok=True)
        for path, config in paths_of(whole).items():
            if config in Shard(k, count).of(DESIGN).trials:
                shutil.copytree(path, part / "trials" / path.name)
        run_batch(DESIGN, part, workers=1, shard=Shard(k, count))  # finds all of them there
    return parts


def paths_of(whole):
    found = {}
    for path in sorted((whole / "trials").iterdir()):
        settings = read_trial(path).settings
        (found[path],) = [
            t
            for t in DESIGN.trials
            if (t.house_seed, t.assistance) == (settings["house_seed"], settings["assistance"])
        ]
    return found


def contents(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_a_shard_reads_its_own_trials_only_and_writes_no_tables(whole, tmp_path, monkeypatch):
    out = shutil.copytree(whole, tmp_path / "out", ignore=shutil.ignore_patterns("trials.*", ".rows*"))
    own = Shard(2, 5).of(DESIGN).trials
    before = contents(out)
    for path, config in paths_of(whole).items():
        if config not in own:  # what others have there is no concern of this shard
            (out / "trials" / path.name / records.EVENTS).write_text("damaged")
            before[Path("trials") / path.name / records.EVENTS] = b"damaged"
    read = []
    monkeypatch.setattr(
        trial_reader, "read_trial", lambda path: (read.append(path.name), read_trial(path))[1]
    )
    notes = []
    rows = run_batch(DESIGN, out, workers=1, shard=Shard(2, 5), on_note=notes.append)
    assert notes == [] and len(read) == 2
    assert [(row["house_seed"], row["assistance"]) for row in rows] == [
        (t.house_seed, t.assistance) for t in own
    ]
    after = contents(out)
    rows_file = Path(".rows.2-of-5.jsonl.gz")
    assert set(after) == {*before, rows_file} and all(
        after[name] == content for name, content in before.items()
    )


@pytest.mark.slow
@pytest.mark.long
def test_shards_with_packed_trials_merge_into_what_one_machine_makes(whole, tmp_path):
    """Each shard has archives of its own, which it never shares with another machine; the parts are not changed."""
    shared, parts = tmp_path / "shared", [tmp_path / "one", tmp_path / "two"]
    for k, part in enumerate(parts, start=1):
        rows = run_batch(DESIGN, shared, workers=1, shard=Shard(k, 2), packed=True)
        assert len(rows) == 5
        (archive,) = (shared / "trials").glob(f"{k}-of-2.*.sqlar")
        (part / "trials").mkdir(parents=True)
        for path in (archive, shared / f".rows.{k}-of-2.jsonl.gz"):
            shutil.copy(path, part / path.relative_to(shared))
    before = [contents(part / "trials") for part in parts]
    for folder in (shared, parts[1]):
        archive = next((folder / "trials").glob("2-of-2.*.sqlar"))
        archive.rename(archive.with_name(f".{archive.name}"))  # as a killed worker leaves it
    for out, of in ((shared, []), (tmp_path / "merged", parts), (tmp_path / "merged", parts)):
        merged = merge_shards(DESIGN, out, of)
        assert merged.missing == [] and not any(path.is_dir() for path in (out / "trials").iterdir())
        assert without_wall(out) == without_wall(whole)
    assert [contents(part / "trials") for part in parts] == before
    mixed = merge_shards(DESIGN, tmp_path / "mixed", [parts[0], whole])
    assert mixed.missing == [] and without_wall(tmp_path / "mixed") == without_wall(whole)


def test_a_trial_that_ended_early_is_replaced_by_a_complete_one(whole, tmp_path):
    early = shutil.copytree(whole, tmp_path / "out", ignore=shutil.ignore_patterns(".rows*"))
    path = next((early / "trials").iterdir())
    for name in (records.EVENTS, records.METRICS):
        text = (path / name).read_text()
        (path / name).write_text(text.replace('"time limit"', '"interrupted"'))
    write_checksums(path, records.FILES)
    assert not read_trial(path).complete
    merged = merge_shards(DESIGN, early, [whole])
    assert merged.missing == [] and read_trial(path).complete
    assert not read_trial(early / "outdated" / path.name).complete


def without_wall(folder):
    return [{k: v for k, v in row.items() if k != "wall_s"} for row in read_rows(folder / "trials.parquet")]


@pytest.mark.parametrize("links", [True, False])
@pytest.mark.parametrize("shared", [True, False])
def test_merged_tables_are_those_of_one_machine(whole, tmp_path, monkeypatch, shared, links):
    parts = parts_of(whole, tmp_path, 3, shared)
    if not links:
        monkeypatch.setattr(
            os, "link", lambda *_: (_ for _ in ()).throw(OSError(18, "Invalid cross-device link"))
        )
    monkeypatch.setattr(trial_reader, "read_trial", None)  # the shards have read everything
    before = [contents(part) for part in parts]
    out = parts[0] if shared else tmp_path / "merged"
    for _ in range(2):  # merging again changes nothing
        merged = merge_shards(DESIGN, out, [] if shared else parts)
        assert (merged.missing, merged.shards) == ([], {})
        for name in ("trials.parquet", "trials.csv"):
            assert (out / name).read_bytes() == (whole / name).read_bytes()
    if not shared:
        assert [contents(part) for part in parts] == [
            {**old, **{k: v for k, v in contents(part).items() if k.name == ".rows.jsonl.gz"}}
            for old, part in zip(before, parts, strict=True)
        ]
        assert {p.name for p in (out / "trials").iterdir()} == {p.name for p in (whole / "trials").iterdir()}


def test_missing_trials_are_named_by_shard(whole, tmp_path, capsys):
    parts = parts_of(whole, tmp_path, 5)
    lost = [next(parts[k].glob("trials/*")) for k in (1, 4)]
    for path in lost:
        shutil.rmtree(path)
    merged = merge_shards(DESIGN, tmp_path / "out", parts)
    assert merged.shards == {Shard(2, 5): 1, Shard(5, 5): 1}
    assert len(merged.rows) == 8 and len(merged.missing) == 2
    arguments = ["--objects", "1", "--assistance", "none,optimal", "--seeds", "0:5", "--fidelity", "event"]
    code = main(
        ["batch", *arguments, "--no-regret", "--time-limit", "0.2", "--out", str(tmp_path / "out"), "--merge"]
        + [str(part) for part in parts]
    )
    text = " ".join(capsys.readouterr().err.split())
    assert code == 1
    assert "2 of 10 trials are missing: run again --shard 2/5 (1), --shard 5/5 (1), then merge again" in text
    assert main(["batch", "--out", str(tmp_path / "out"), "--merge"]) == 1
    text = " ".join(capsys.readouterr().err.split())
    assert "30 of 30 trials are missing: give --merge the DESIGN.toml or the options" in text


def test_a_trial_that_differs_in_two_parts_is_named_and_nothing_is_merged(whole, tmp_path):
    one, other = (shutil.copytree(whole, tmp_path / name) for name in ("one", "other"))
    assert merge_shards(DESIGN, tmp_path / "out", [one, other]).missing == []
    path = next((other / "trials").iterdir())
    shutil.rmtree(path)
    longer = paths_of(whole)[whole / "trials" / path.name]
    run_trial(longer, path, topdown=False)
    start = (path / records.EVENTS).read_text()
    (path / records.EVENTS).write_text(start.replace('"rooms": 7', '"rooms": 8', 1))
    write_checksums(path, records.FILES)
    with pytest.raises(
        RecordError, match=f"one/trials/{path.name} and .*other/trials/{path.name} are the same trial"
    ):
        merge_shards(DESIGN, tmp_path / "fresh", [one, other])
    assert not any((tmp_path / "fresh" / "trials").iterdir())


def test_a_part_that_is_no_batch_is_named(whole, tmp_path):
    with pytest.raises(RecordError, match="is not the folder of a batch"):
        merge_shards(DESIGN, tmp_path / "out", [whole, tmp_path / "nothing"])


PAPER = [sys.executable, "-m", "mjsim", "study", "simulate", "paper", "--people", "15"]


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """The folder of the study, simulated by one machine."""
    out = tmp_path_factory.mktemp("simulated") / "one"
    subprocess.run([*PAPER, "--out", str(out)], check=True)
    return out


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("shared", [True, False])
def test_shards_that_were_killed_and_started_again_make_what_one_machine_makes(simulated, tmp_path, shared):
    """As in an array job: all tasks run at the same time, some are killed, and those that are incomplete run again."""
    study = [*PAPER, "--workers", "1"]
    outs = [tmp_path / ("shared" if shared else f"part{k}") for k in range(1, 6)]
    merging = [*study, "--out", str(outs[0] if shared else tmp_path / "merged"), "--merge"]
    merging += [] if shared else map(str, outs)

    def start(k):
        return subprocess.Popen(
            [*study, "--shard", f"{k}/5", "--out", str(outs[k - 1])], start_new_session=True
        )

    tasks = {k: start(k) for k in range(1, 6)}
    for k in (2, 4):
        began = outs[k - 1] / f".rows.{k}-of-5.jsonl.gz"
        while not began.exists() or not any((outs[k - 1] / "trials").iterdir()):
            assert tasks[k].poll() is None
            time.sleep(0.05)
        os.killpg(tasks[k].pid, signal.SIGKILL)
    assert [tasks[k].wait() for k in tasks] == [0, -signal.SIGKILL, 0, -signal.SIGKILL, 0]
    incomplete = subprocess.run(merging, stderr=subprocess.PIPE, text=True, check=False)
    again = [k for k in tasks if f"--shard {k}/5 (" in incomplete.stderr]
    assert incomplete.returncode == 1 and again and set(again) <= {2, 4}
    assert [start(k).wait() for k in again] == [0] * len(again)
    subprocess.run(merging, check=True)
    out = Path(merging[merging.index("--out") + 1])
    merged, whole = without_wall(out), without_wall(simulated)
    assert len(merged) == 15 and repr(merged) == repr(whole)  # in order and types, too
    for name in (records.EVENTS, records.TRAJECTORY, records.RECORDING):
        one, other = (
            {path.parent.name: path.read_bytes() for path in folder.glob(f"trials/*/{name}")}
            for folder in (simulated, out)
        )
        assert one == other
