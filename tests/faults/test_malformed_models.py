"""Damaged houses, objects and episodes are used or refused in one line: no traceback, no crash, no hang.

`--hypothesis-profile thorough` tries thousands.
"""

import faulthandler
import re
import sys

import numpy as np
import pytest
from example_house import FILES, write_example_house
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from experiments.cli.failures import exit_code
from experiments.house import House
from mjsim.actions import Move
from mjsim.episode import Episode
from mjsim.errors import PhysicsError
from mjsim.model.scene import compose
from mjsim.world import World

LIMIT = 60.0  # s for one case
EPISODE = "episode.json"
VALUES = ["", *"nan inf -inf -1 0 1e300 1e30 1e9 99999 -1e-300 x 0x10 1,5 --1".split()]  # noqa: SIM905
WORDS = re.compile(r"[A-Za-z_][\w:/.]*")
NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")
ELEMENT = re.compile(r"<[^<>]+>|^\[[^\]]*\]$|^\w+ = .*$|\{[^{}]*\}", re.MULTILINE)
ATTRIBUTE = re.compile(r' ?[\w:]+="[^"]*"|"\w+": [^,\n]*,?')
NESTS = ("<body>", "</body>"), ("[", "]"), ('{"a":', "}")


def replaced(draw, text, pattern, new):
    """The text with one match of a pattern, if there is any, turned into something new."""
    matches = list(pattern.finditer(text))
    if not matches:
        return text
    match = draw(st.sampled_from(matches))
    return text[: match.start()] + new(match.group()) + text[match.end() :]


def swapped(draw, text, pattern):
    """One match of a pattern in the place of another."""
    return replaced(draw, text, pattern, lambda _: draw(st.sampled_from(pattern.findall(text))))


def flipped(draw, text):
    data = bytearray(text.encode())
    for _ in range(draw(st.integers(1, 3))):
        data[draw(st.integers(0, len(data) - 1))] = draw(st.integers(0, 255))
    return bytes(data)


def scaled(draw, text):
    factor = draw(st.sampled_from([-1.0, 0.001, 0.1, 0.9, 1.1, 1.5, 10.0, 1000.0]))
    return replaced(draw, text, NUMBER, lambda number: f"{float(number) * factor:g}")


def nested(draw, text):
    depth, at = draw(st.sampled_from([50, 600, 20_000])), place(draw, text)
    opening, closing = draw(st.sampled_from(NESTS))
    return text[:at] + opening * depth + closing * depth + text[at:]


def place(draw, text, least=0):
    return draw(st.integers(least, len(text)))


CHANGES = {
    "bytes flipped": flipped,
    "end cut off": lambda draw, text: text[: place(draw, text)],
    "part cut out": lambda draw, text: text[: (at := place(draw, text))] + text[place(draw, text, at) :],
    "element deleted": lambda draw, text: replaced(draw, text, ELEMENT, lambda _: ""),
    "element doubled": lambda draw, text: replaced(draw, text, ELEMENT, lambda element: element * 2),
    "attribute deleted": lambda draw, text: replaced(draw, text, ATTRIBUTE, lambda _: ""),
    "number replaced": lambda draw, text: replaced(
        draw, text, NUMBER, lambda _: draw(st.sampled_from(VALUES))
    ),
    "number scaled": scaled,
    "numbers swapped": lambda draw, text: swapped(draw, text, NUMBER),
    "words swapped": lambda draw, text: swapped(draw, text, WORDS),
    "elements swapped": lambda draw, text: swapped(draw, text, ELEMENT),
    "nested deeply": nested,
    "other encoding": lambda draw, text: text.replace("o", "ö").encode(
        draw(st.sampled_from(["latin-1", "utf-16", "utf-32"]))
    ),
    "zero byte": lambda draw, text: text[: (at := place(draw, text))] + "\0" + text[at:],
    "empty": lambda _, text: text[:0],
}


@pytest.fixture(scope="module")
def episode(tmp_path_factory):
    """An episode of the good house, whose folder it calls HOUSE."""
    folder = tmp_path_factory.mktemp("good")
    house = House.load(str(write_example_house(folder)))
    return house.sample_episode(objects=3, seed=0, points=5).to_json().replace(str(folder), "HOUSE")


@pytest.mark.slow
@settings(suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(
    data=st.data(), name=st.sampled_from(sorted([*FILES, EPISODE])), change=st.sampled_from(sorted(CHANGES))
)
def test_damaged_files_are_used_or_refused_in_one_line(data, name, change, episode, tmp_path_factory):
    folder = tmp_path_factory.mktemp("damaged")
    catalogue = write_example_house(folder)
    (folder / EPISODE).write_text(episode.replace("HOUSE", str(folder)))
    damaged = CHANGES[change](data.draw, (folder / name).read_text(encoding="utf-8"))
    (folder / name).write_bytes(damaged if isinstance(damaged, bytes) else damaged.encode())
    faulthandler.dump_traceback_later(LIMIT, exit=True, file=sys.__stderr__)
    try:
        use(catalogue, folder / EPISODE if name == EPISODE else None)
    except Exception as error:
        if exit_code(error) is None:
            raise
        assert "\n" not in str(error)
        assert 10 <= len(str(error)) <= 2000
    finally:
        faulthandler.cancel_dump_traceback_later()


def use(catalogue, episode_file):
    """Load, sample or read an episode, and walk a few steps; what is accepted must work."""
    house = House.load(str(catalogue))
    episode = (
        house.sample_episode(objects=3, seed=0, points=5)
        if episode_file is None
        else Episode.load(episode_file)
    )
    world = World(compose(episode, house.catalogue))
    try:
        seen = [world.step(Move(forward=1.0, turn=0.5)).observation for _ in range(10)][-1]
    except PhysicsError as error:
        raise AssertionError("accepted, but the physics failed") from error
    assert np.isfinite(seen.position).all() and np.isfinite(seen.object_positions).all()
