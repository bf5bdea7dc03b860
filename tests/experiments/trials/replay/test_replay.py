"""Replays: bit for bit what was recorded, from anywhere, and whatever is not as recorded is named with its step."""

import dataclasses
import hashlib
import json
import re
import shutil
import subprocess
import sys
from importlib.metadata import version

import numpy as np
import pytest
from example_house import write_example_house
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from user_code import participant

from experiments.cli.main import main
from experiments.errors import RecordError, ReplayError
from experiments.record import records
from experiments.record.columns import TRAJECTORY_COLUMNS
from experiments.record.files import read_arrays, read_json, write_checksums
from experiments.record.reader import read_run
from experiments.record.records import read_events
from experiments.session.film_config import FilmConfig
from experiments.session.session import Session
from experiments.trials.replay.replay import ReplayFilm, as_seen, replay
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from mjsim.values.errors import PhysicsError

pytestmark = pytest.mark.usefixtures("frequent_checkpoints")
DT = 0.04
SMALL = FilmConfig(320, 240, "draft")
FEW = settings(
    max_examples=6,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
COLUMNS = [(records.RECORDING, "state_hash"), *((records.TRAJECTORY, name) for name in TRAJECTORY_COLUMNS)]
FAULTS = {"state_hash": "the state differs", "action": "trajectory.npz: the action"}


@pytest.fixture(scope="module")
def run(house, tmp_path_factory):
    """16 s of a trial: walking, two picks, a place, a time limit."""
    out = tmp_path_factory.mktemp("replay") / "run"
    config = TrialConfig(objects=6, assistance="optimal", seed=3, time_limit=16.0)
    run_trial(config, out, topdown=False, house=house)
    return out


@pytest.fixture(scope="module")
def film(house, tmp_path_factory):
    """3 s of a trial, filmed."""
    out = tmp_path_factory.mktemp("replay") / "film"
    config = TrialConfig(objects=6, assistance="optimal", seed=3, time_limit=3.0)
    run_trial(config, out, film=SMALL, topdown=False, house=house)
    return out


@pytest.fixture
def copy(run, tmp_path):
    return shutil.copytree(run, tmp_path / "copy", dirs_exist_ok=True)


def restored(run, copy):
    """The copy as it was: Hypothesis calls a test many times with one fixture."""
    shutil.copytree(run, copy, dirs_exist_ok=True)
    return copy


def change(folder, file, **changes):
    """Rewrite arrays of an NPZ."""
    arrays = {**read_arrays(folder / file), **changes}
    np.savez_compressed(folder / file, **arrays)


def rewrite_log(folder, edit):
    """Change log lines and their hashes consistently, as somebody would who knows how they are made."""
    path = folder / records.EVENTS
    recorded = read_arrays(folder / records.RECORDING)
    before = path.read_bytes()
    counts = [before[:size].count(b"\n") for size in recorded["log_size"]]
    lines = [(json.dumps(e) + "\n").encode() for e in map(edit, read_events(path))]
    parts = [b"".join(lines[:count]) for count in counts]
    path.write_bytes(b"".join(lines))
    sizes = np.array([len(part) for part in parts], np.int64)
    hashes = [int.from_bytes(hashlib.sha1(part).digest()[:8], "little") for part in parts]
    change(folder, records.RECORDING, log_size=sizes, log_hash=np.array(hashes, np.uint64))
    write_checksums(folder, records.FILES)


def bad_step(folder, house, **options):
    with pytest.raises(ReplayError) as caught:
        replay(folder, house=house, **options)
    assert len(str(caught.value).splitlines()) == 1
    assert caught.value.step is not None
    return caught.value.step, str(caught.value)


# A run replays.


@pytest.mark.slow
def test_a_run_replays_in_another_process(run):
    done = subprocess.run(
        [sys.executable, "-m", "experiments.cli.main", "replay", str(run)],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    assert done.stdout.splitlines()[-1] == "401 steps verified; the run ended with 'time limit'"


def test_a_run_replays_from_every_checkpoint(run, house):
    """From the last one before a time."""
    steps = [0, *read_arrays(run / records.RECORDING)["checkpoint_step"].tolist()]
    assert len(steps) >= 5
    for step in steps[1:]:
        report = replay(run, house=house, start=step * DT)
        assert (report.first, report.steps) == (step, 401 - step)
    assert replay(run, house=house, start=(steps[-1] - 1) * DT).first == steps[-2]


def test_checkpoints_are_taken_between_motions_only(run):
    """While somebody reaches, the hands move without the walk: an attempt that was applied begins it."""
    events = read_events(run / records.EVENTS)
    begun = [e["t"] for e in events if e["event"] == "attempt" and e["applied"]]
    over = [e["t"] for e in events if e["event"] in ("picked", "placed", "pick_failed", "place_failed")]
    times = read_arrays(run / records.RECORDING)["checkpoint_step"] * DT
    for start, end in zip(begun, over, strict=False):
        assert not np.any((times > start - DT / 2) & (times < end - DT / 2))


def test_every_kind_of_action_replays(house, tmp_path, own_module):
    """Names that the house does not have are refused again with the same words."""
    actions = (
        "[Pick('ghost'), Place('ghoul'), Pick(None), Place(None), Pick('ghost'), Move(0.1, -0.0, 1e-300)]"
    )
    own_module(participant(f"if self.count <= 6: return {actions}[self.count - 1]"))
    config = TrialConfig(objects=6, assistance="none", seed=0, user="own_code:build", time_limit=1.0)
    run_trial(config, tmp_path / "run", topdown=False, house=house)
    asked = [e["object"] for e in read_events(tmp_path / "run" / records.EVENTS) if e["event"] == "attempt"]
    assert (asked[0], asked[1], asked[4]) == ("ghost", "ghoul", "ghost")
    assert replay(tmp_path / "run", house=house).steps == 26


# What is not as recorded is named with the first bad step.


@pytest.mark.slow
@settings(FEW, max_examples=12)
@given(step=st.integers(0, 400), column=st.sampled_from(COLUMNS), data=st.data())
def test_a_changed_value_is_named_with_its_step(run, copy, house, step, column, data):
    """The least change, and values that are huge or no numbers."""
    folder, (file, name) = restored(run, copy), column
    values = read_arrays(folder / file)[name]
    place = (step, *(data.draw(st.integers(0, n - 1)) for n in values.shape[1:]))
    if values.dtype.kind == "f":
        changed = data.draw(st.sampled_from([np.nextafter(values[place], 9.0), np.nan, -np.inf, 1e308]))
        assume(not np.array_equal(changed, values[place], equal_nan=True))
    else:
        changed = values[place] + 1
    values[place] = changed
    change(folder, file, **{name: values})
    found, message = bad_step(folder, house)
    assert found == step
    fault = FAULTS.get(name, f"trajectory.npz: {name} is not what the replay gives")
    assert f"first bad step {step} (t = {step * DT:.2f} s): {fault}" in message


def test_a_changed_action_with_its_hash_shows_in_the_state_that_follows(copy, house):
    actions = read_arrays(copy / records.TRAJECTORY)["action"]
    step = int(np.flatnonzero(actions[:, 2] > 0.5)[5])
    actions[step, 2] -= 1e-9
    change(copy, records.TRAJECTORY, action=actions)
    hashes = read_arrays(copy / records.RECORDING)["action_hash"]
    digest = hashlib.sha1(actions[step].tobytes()).digest()
    hashes[step] = int.from_bytes(digest[:8], "little")
    change(copy, records.RECORDING, action_hash=hashes)
    found, message = bad_step(copy, house)
    assert found == step + 1
    assert "the state differs" in message


@settings(FEW, max_examples=12)
@given(whole=st.booleans(), data=st.data())
def test_a_changed_or_shortened_log(run, copy, house, whole, data):
    """Any other byte anywhere, even if it still reads the same; or an end anywhere."""
    folder = restored(run, copy)
    path = folder / records.EVENTS
    log = bytearray(path.read_bytes())
    place = data.draw(st.integers(0, len(log) - 1))
    time = json.loads(log.splitlines()[log[:place].count(b"\n")])["t"]
    if whole:
        log[place] ^= 1
        assume(f'"format": {records.LOG_FORMAT},'.encode() in log)  # of another format, nothing more is said
    path.write_bytes(log if whole else log[:place])
    found, message = bad_step(folder, house)
    assert abs(found - time / DT) <= 1.01
    assert "events.jsonl" in message


def test_a_log_that_goes_on(copy, house):
    with (copy / records.EVENTS).open("a") as file:
        file.write('{"t": 16.0, "event": "picked", "object": "object_00", "receptacle": null}\n')
    found, message = bad_step(copy, house)
    assert found == 400
    assert "continues after its end" in message


def test_a_forged_event_with_its_hashes(copy, house):
    events = read_events(copy / records.EVENTS)
    picked = next(e for e in events if e["event"] == "picked")
    rewrite_log(copy, lambda e: {**e, "object": "object_05x"} if e == picked else e)
    found, message = bad_step(copy, house)
    assert abs(found - picked["t"] / DT) <= 1.01
    assert "picked object_05x" in message


@FEW
@given(number=st.integers(0, 3), data=st.data())
def test_a_changed_checkpoint(run, copy, house, number, data):
    folder = restored(run, copy)
    recorded = read_arrays(folder / records.RECORDING)
    physics, details = recorded["checkpoint_physics"], recorded["checkpoint_details"]
    if data.draw(st.booleans()):
        place = data.draw(st.integers(0, physics.shape[1] - 1))
        physics[number, place] = np.nextafter(physics[number, place], 9.0)
    else:
        details[number] = str(details[number]).replace("loose", "carried", 1)
    change(folder, records.RECORDING, checkpoint_physics=physics, checkpoint_details=details)
    step = int(recorded["checkpoint_step"][number])
    assert bad_step(folder, house)[0] == step
    assert bad_step(folder, house, start=step * DT)[0] == step


@FEW
@given(steps=st.integers(0, 400), file=st.sampled_from([records.TRAJECTORY, records.RECORDING]))
def test_arrays_cut_short(run, copy, house, steps, file):
    folder = restored(run, copy)
    name = "action" if file == records.TRAJECTORY else "state_hash"
    change(folder, file, **{name: read_arrays(folder / file)[name][:steps]})
    assert bad_step(folder, house)[0] == steps


def test_another_episode(copy, house):
    path = copy / records.EPISODE
    path.write_text(path.read_text().replace('"seed": 3', '"seed": 4'))
    found, message = bad_step(copy, house)
    assert found == 0
    assert "episode.json is not the episode that was run" in message


@pytest.mark.parametrize("number", [3, 99])
def test_a_run_of_another_format_is_refused_by_its_version(tmp_path, number, capsys):
    """In one line that says what to do; nothing else of the run is read."""
    start = {"t": 0.0, "event": "start", "format": number, "versions": {"mjsim": "0.1.0"}, "order": []}
    (tmp_path / records.EVENTS).write_text(json.dumps(start) + "\n")
    refused = (
        f"{tmp_path} has log format {number} of mjsim 0.1.0; this version replays format {records.LOG_FORMAT} only: "
        "replay it with the version that wrote it, or run the trial again"
    )
    with pytest.raises(ReplayError, match=re.escape(refused)):
        read_run(tmp_path)
    assert main(["replay", str(tmp_path)]) == 1
    assert capsys.readouterr().err.splitlines()[-1] == f"mjsim: {refused}"


def test_a_folder_that_is_no_run(tmp_path, capsys):
    with pytest.raises(RecordError, match="is not a run directory"):
        read_run(tmp_path)
    assert main(["replay", str(tmp_path)]) == 2
    assert capsys.readouterr().err.strip().splitlines()[-1].startswith("mjsim: ")


def test_a_mismatch_is_one_line_and_exit_code_1(copy, capsys):
    (copy / records.EVENTS).write_bytes((copy / records.EVENTS).read_bytes()[:-1])
    assert main(["replay", str(copy)]) == 1
    last = capsys.readouterr().err.strip().splitlines()[-1]
    assert last.startswith("mjsim: ")
    assert "first bad step 400 (t = 16.00 s): events.jsonl is truncated" in last


# Why a replay may differ.


def test_another_engine_that_does_the_same_is_mentioned_only(copy, house):
    rewrite_log(
        copy, lambda e: {**e, "versions": {**e["versions"], "mujoco": "3.0.0"}} if "versions" in e else e
    )
    assert replay(copy, house=house).differences == (f"MuJoCo was 3.0.0, is {version('mujoco')}",)


@pytest.fixture
def own_house(tmp_path):
    """The catalogue of a house of one's own."""
    return write_example_house(tmp_path / "house")


def own_trial(catalogue, out, seconds):
    config = TrialConfig(
        objects=4, assistance="optimal", seed=0, house=str(catalogue), points=5, time_limit=seconds
    )
    run_trial(config, out, topdown=False)


def test_a_changed_house_is_named_as_the_reason(own_house, tmp_path):
    own_trial(own_house, tmp_path / "run", 2.0)
    assert replay(tmp_path / "run").steps == 51
    block = own_house.with_name("block.xml")
    block.write_text(block.read_text().replace("0.8 0.2 0.2 1", "0.2 0.8 0.2 1"))
    assert replay(tmp_path / "run").differences == ()  # only the looks
    block.write_text(block.read_text().replace('mass="0.3"', 'mass="1.3"'))
    with pytest.raises(
        ReplayError, match=r"first bad step \d+ .*since it was recorded: the compiled house was"
    ):
        replay(tmp_path / "run")


def test_a_run_in_a_house_that_was_moved(own_house, tmp_path, capsys):
    """Replayed where the house lies now, if it is the same one; its files are found beside the catalogue."""
    own_trial(own_house, tmp_path / "run", 1.0)
    moved = own_house.parent.rename(tmp_path / "elsewhere") / own_house.name
    assert main(["replay", str(tmp_path / "run")]) == 2
    assert "if it was moved, name its catalogue with --house" in capsys.readouterr().err
    assert main(["replay", str(tmp_path / "run"), "--house", str(moved)]) == 0
    assert "26 steps verified" in capsys.readouterr().out
    block = moved.with_name("block.xml")
    block.write_text(block.read_text().replace('mass="0.3"', 'mass="0.4"'))
    assert main(["replay", str(tmp_path / "run"), "--house", str(moved)]) == 1
    assert "is not the house of" in capsys.readouterr().err


# A failure leaves what led to it.

# A joint inside the block that is pushed away from its middle, the harder the farther it is: e-fold in 0.1 s.
BOMB = """
      <body name="bomb">
        <inertial pos="0 0 0" mass="1e-4" diaginertia="1e-8 1e-8 1e-8"/>
        <joint name="fuse" type="hinge" axis="0 0 1" stiffness="-100" springref="-0.01" armature="1"/>
      </body>
    </body>"""


def test_a_physics_error_leaves_a_dump_that_replays(own_house, tmp_path, capsys, monkeypatch):
    # Two bodies in an object: a house that is refused.
    monkeypatch.setattr("mjsim.house.validation.validate.check_house", lambda _: [])
    block = own_house.with_name("block.xml")
    block.write_text(block.read_text().replace("</body>", BOMB))
    with pytest.raises(PhysicsError, match=r"kept for `mjsim replay .*run`"):
        own_trial(own_house, tmp_path / "run", 20.0)
    dump = tmp_path / "run"
    assert read_json(dump / records.METRICS)["ended"] == "physics error"
    last = read_events(dump / records.EVENTS)[-1]
    assert last["reason"] == "physics error"
    report = replay(dump)
    assert report.failure == last["error"]
    assert report.steps == round(last["t"] / DT) + 1 > 50
    assert main(["replay", str(dump), "--from", str(last["t"])]) == 0
    assert "so does the replay: MuJoCo warned" in capsys.readouterr().out


# Other views.


def frames_of(folder, house, tmp_path, **options):
    camera = options.pop("camera", "first-person")
    target = ReplayFilm(tmp_path / "film.mp4", SMALL, camera)
    return replay(folder, house=house, film=target, **options)


@pytest.mark.slow
def test_a_replay_films_the_same_frames(film, house, tmp_path):
    report = frames_of(film, house, tmp_path)
    assert report.frames_sha256 == read_json(film / records.METRICS)["frames_sha256"]
    assert report.as_filmed


@pytest.mark.slow
def test_a_replay_shows_the_list_scrolled_as_it_was(house, tmp_path):
    rows, advance = {0: 2, 10: 3, 45: -1, 60: 20}, Session.advance  # scrolled by so many, by control step
    frames = []

    def scrolling(session):
        if session.record.step in rows:
            session.scroll(rows[session.record.step])
        advance(session)

    config = TrialConfig(objects=6, assistance="optimal", seed=3, time_limit=3.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("experiments.session.video.VideoWriter.write", lambda _, frame: frames.append(frame))
        run_trial(config, tmp_path / "plain", film=SMALL, topdown=False, house=house)
        plain, frames[:] = frames.copy(), []
        with patch.context() as scroll:
            scroll.setattr(Session, "advance", scrolling)
            run_trial(config, tmp_path / "run", film=SMALL, topdown=False, house=house)
        filmed = frames.copy()
        differ = [not np.array_equal(a, b) for a, b in zip(plain, filmed, strict=True)]
        assert all(differ[:40]), "the list is scrolled until a visit is made"
        for start in (0.0, 2.0):
            frames.clear()
            first = frames_of(tmp_path / "run", house, tmp_path, start=start).first
            assert (first > 0) is (start > 0)
            assert all(np.array_equal(a, b) for a, b in zip(filmed[first:], frames, strict=True))


@pytest.mark.slow
@pytest.mark.parametrize("options", [{"assistance": "none"}, {"camera": "top-down"}, {"camera": "free"}])
def test_another_view_of_the_same_run(film, house, tmp_path, options):
    report = frames_of(film, house, tmp_path, start=2.0, **options)
    assert report.first + report.steps == 76
    assert report.as_filmed is False


@pytest.mark.parametrize(
    ("draw", "view", "frame"),
    [
        ("browser", (1500, 750), (1280, 640)),
        ("browser", (200, 100), (416, 312)),
        ("server", (1500, 750), None),
    ],
)
def test_a_film_has_the_shape_of_the_page(run, draw, view, frame):
    display = {"event": "display", "draw": draw, "width": view[0], "height": view[1], "field_of_view": 1.9}
    log = json.dumps(display).encode() + b"\n"
    config = as_seen(dataclasses.replace(read_run(run), log=log), "draft")
    left, top, width, height = config.view
    assert config.profile == "draft" and config.width % 2 == 0 and config.height % 2 == 0
    assert 0 < left < config.width - width and 0 < top < config.height - height
    if frame is None:
        assert config == FilmConfig.with_panels(profile="draft")
        assert (config.width, config.height) == (960, 540) and 3 * width == 4 * height
    else:
        assert (width, height, config.field_of_view) == (*frame, 1.9)


@pytest.mark.slow
def test_a_replay_that_fails_leaves_no_film(film, house, tmp_path):
    folder = shutil.copytree(film, tmp_path / "copy")
    hashes = read_arrays(folder / records.RECORDING)["state_hash"]
    hashes[3] += np.uint64(1)
    change(folder, records.RECORDING, state_hash=hashes)
    with pytest.raises(ReplayError):
        frames_of(folder, house, tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["copy"]


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (["--camera", "free"], "a camera needs a film"),
        (["--video", "x.mp4", "--camera", "top-down", "--eye", "1,2,3"], "only --camera free takes --eye"),
        (["--video", "x.mp4", "--profile", "sepia"], "no render profile 'sepia'"),
        (["--video", "x.txt"], "cannot film to x.txt: name a file that ends in .mp4"),
        (["--from", "1e9"], "s; start earlier than 1e+09 s"),
        (["--assistance", "telepathy"], "no assistance condition 'telepathy'"),
    ],
)
def test_unusable_options_are_named(run, arguments, fault, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["replay", str(run), *arguments]) == 2
    assert fault in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
