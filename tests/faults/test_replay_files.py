"""Damaged, forged, swapped and truncated run directories: a replay notices every one, in one line."""

import json
import math
import pickle
import shutil

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.errors import ExperimentError
from experiments.record import records
from experiments.record.files import (
    CHECKSUMS,
    read_arrays,
    read_json,
    save_arrays,
    write_checksums,
    write_json,
)
from experiments.record.metrics import CIRCUMSTANCES
from experiments.record.reader import read_run
from experiments.record.verify import checksum_mismatches, derived_mismatches
from experiments.trials.replay.replay import replay
from experiments.trials.trial import TrialConfig, run_trial
from faults.test_malformed_files import BAD_TEXTS

OTHER_CONTENT = (*BAD_TEXTS.values(), b"\xff\xfe", b"NaN", b"{}", b"[1]", b'"x"')
FILES = (*records.FILES, CHECKSUMS)


def make_run(out, house, seed, seconds):
    config = TrialConfig(objects=6, assistance="optimal", seed=seed, time_limit=seconds, fidelity="event")
    run_trial(config, out, topdown=False, house=house)
    # Pictures as a replay sees them: files whose checksum was written with the run. Nothing has to be drawn for that.
    for name in (records.TOPDOWN, records.VIDEO):
        (out / name).write_bytes(np.random.default_rng(seed).bytes(2000))
    write_checksums(out, records.FILES)
    return out


@pytest.fixture(scope="session")
def run(house, tmp_path_factory):
    """12 s with a pick: a record of every kind."""
    return make_run(tmp_path_factory.mktemp("faults") / "run", house, 3, 12.0)


@pytest.fixture(scope="session")
def other(house, tmp_path_factory):
    return make_run(tmp_path_factory.mktemp("faults") / "other", house, 4, 12.0)


@pytest.fixture
def copy(run, tmp_path):
    return shutil.copytree(run, tmp_path / "copy")


def fault_of(folder, house):
    """The one line that refuses a run; fails if it is accepted, or if anything but a typed error comes."""
    with pytest.raises(ExperimentError) as caught:
        replay(folder, house=house)
    line = str(caught.value)
    assert len(line.splitlines()) == 1 and len(line) > 20
    return caught.value


def test_the_run_itself_is_verified(run, other, house):
    for folder in (run, other):
        report = replay(folder, house=house)
        assert {verdict.file for verdict in report.verdicts} == set(records.FILES)
        assert all(verdict.verified for verdict in report.verdicts)


@st.composite
def damaged(draw, content, another):
    """The content of a file with a flipped bit, cut off, that of another run, or something else altogether."""
    place = draw(st.integers(0, len(content) - 1))
    flipped = bytearray(content)
    flipped[place] ^= 1 << draw(st.integers(0, 7))
    return draw(st.sampled_from([bytes(flipped), content[:place], another, *OTHER_CONTENT]))


@pytest.mark.slow
@settings(max_examples=60)
@given(st.sampled_from(FILES), st.booleans(), st.data())
def test_every_damage_is_noticed(run, other, house, tmp_path_factory, name, resummed, data):
    """Also where the checksums are written anew, but for pictures: only their checksums are claimed."""
    content, another = (run / name).read_bytes(), (other / name).read_bytes()
    copy = shutil.copytree(run, tmp_path_factory.mktemp("damaged") / "copy")
    resummed = resummed and name not in (records.TOPDOWN, records.VIDEO, CHECKSUMS)
    (copy / name).write_bytes(
        data.draw(st.sampled_from(OTHER_CONTENT) if resummed else damaged(content, another))
    )
    if resummed:
        write_checksums(copy, records.FILES)
    fault_of(copy, house)


@pytest.mark.parametrize("name", FILES)
def test_half_a_file_and_none_are_noticed(copy, house, name):
    content = (copy / name).read_bytes()
    (copy / name).write_bytes(content[: len(content) // 2])
    fault_of(copy, house)
    (copy / name).unlink()
    fault_of(copy, house)


# Forgeries with right checksums.


def forged_values(value):
    """Other values for a field: another one of its kind, of other kinds, not finite."""
    if isinstance(value, bool):
        others = [not value]
    elif isinstance(value, int | float):
        others = [value + 1, -value - 1, str(value), float("nan"), float("inf")]
    else:
        others = [1, "forged", []]
    return [other for other in [*others, None, {}] if other != value]


def is_json(value):
    return not isinstance(value, float) or math.isfinite(value)


def derived_faults(folder):
    """What is wrong with files that follow from log and trajectory; needs no simulation."""
    record = read_run(folder)
    found = [*derived_mismatches(folder, record), *checksum_mismatches(folder)]
    return "; ".join(mismatch.message for mismatch in found)


@pytest.mark.slow
def test_every_field_of_the_metrics_is_checked(copy, house):
    """What cannot be computed anew is protected by the checksum."""
    path = copy / records.METRICS
    metrics = read_json(path)
    assert len(metrics) > 50 + len(CIRCUMSTANCES)
    for number, name in enumerate(metrics):
        values = forged_values(metrics[name])
        value = values[number % len(values)]
        write_json(path, {**metrics, name: value})
        fault = "is not the file that was written" if name in CIRCUMSTANCES else f"has {name} = "
        fault = fault if is_json(value) else f"{path} is not JSON"
        assert derived_faults(copy).startswith(f"metrics.json {fault}")
    for others in ({**metrics, "score": 9}, {name: metrics[name] for name in [*metrics][1:]}):
        write_json(path, others)
        write_checksums(copy, records.FILES)
        assert "metrics.json" in str(fault_of(copy, house))


@pytest.mark.parametrize("other", [[], "forged", 1, None], ids=repr)
def test_metrics_that_are_no_object_are_noticed(copy, other):
    write_json(copy / records.METRICS, other)
    write_checksums(copy, records.FILES)
    assert derived_faults(copy) == "metrics.json is not an object"


def test_every_field_of_the_plans_is_checked(copy, house):
    path = copy / records.PLAN
    plans = read_json(path)
    for name in plans[0]:
        for value in forged_values(plans[0][name]):
            path.write_text(json.dumps([{**plans[0], name: value}, *plans[1:]]))
            fault = "does not hold the plans of the log" if is_json(value) else f"{path} is not JSON"
            assert derived_faults(copy).startswith(f"plan.json {fault}")
    write_json(path, plans[:-1])
    write_checksums(copy, records.FILES)
    assert "plan.json does not hold the plans of the log" in str(fault_of(copy, house))


@pytest.mark.parametrize("name", [records.TRAJECTORY, records.RECORDING])
def test_arrays_of_other_types_and_shapes_are_refused(copy, house, name):
    path = copy / name
    arrays = read_arrays(path)
    for array in arrays:
        for forged in (
            np.array(["x"] * len(arrays[array])),
            arrays[array][..., None],
            np.zeros(()),
            arrays[array].astype("c16") if arrays[array].dtype.kind != "U" else np.zeros(3),
        ):
            if forged.dtype.kind == "U" and arrays[array].dtype.kind == "U":
                continue
            save_arrays(path, {**arrays, array: forged})
            write_checksums(copy, records.FILES)
            assert array in str(fault_of(copy, house))


def test_a_file_that_was_not_written_with_the_run_is_not_vouched_for(copy, house):
    sums = (copy / CHECKSUMS).read_text().splitlines(keepends=True)
    (copy / CHECKSUMS).write_text("".join(line for line in sums if records.TOPDOWN not in line))
    error = fault_of(copy, house)
    assert "topdown.png was not written with the run" in str(error)
    assert any("topdown.png" in line and "NOT VERIFIED" in line for line in error.verdicts)
    assert any("metrics.json" in line and " verified" in line for line in error.verdicts)


class Harmful:
    def __reduce__(self):
        return print, ("a pickle was executed",)


def test_a_pickle_is_never_executed(copy, house, capsys):
    path, harmful = copy / records.TRAJECTORY, Harmful()
    with_objects = read_arrays(path) | {"time": np.full(400, harmful, dtype=object)}
    for write in (lambda: path.write_bytes(pickle.dumps(harmful)), lambda: np.savez(path, **with_objects)):
        write()
        assert records.TRAJECTORY in str(fault_of(copy, house))
    assert "executed" not in capsys.readouterr().out
