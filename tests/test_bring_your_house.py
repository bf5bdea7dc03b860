"""docs/bring-your-house.md is true: its house is sound, and trials deliver everything in `event` and in `full`."""

import json
import re
import shlex
from pathlib import Path

import pytest

from benchmarks.support.example_house import PAGE, write_example_house
from experiments.cli import main


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("page")
    write_example_house(folder / "my_house")
    return folder


def commands() -> list[list[str]]:
    blocks = re.findall(r"```sh\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    return [shlex.split(line)[1:] for block in blocks for line in block.splitlines()]


def test_the_page_holds_four_files(folder: Path) -> None:
    names = {path.name for path in (folder / "my_house").iterdir()}
    assert names >= {"house.xml", "crate.xml", "block.xml", "catalogue.toml"}


@pytest.mark.parametrize("command", commands(), ids=lambda c: " ".join(c[:1] + c[-1:]))
def test_every_command_of_the_page_works(
    command: list[str], folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder)
    assert main(command) == 0
    if command[0] == "check":
        said = capsys.readouterr().out
        assert "0 errors, 1 warning\n" in said and "--points" in said
    if command[0] == "run":
        metrics = json.loads((folder / command[-1] / "metrics.json").read_text(encoding="utf-8"))
        assert metrics["delivered"] == metrics["objects"] == 4


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('"4 2 2.3"', '"4 2 2.3" ', None),
        ('mount:crate" pos="0.4 3.6 0"', 'mount:crate" pos="0.4 3.6 3"', "above the floor"),
        (
            '<geom name="lintel"',
            '<body name="door" pos="4 2 1"><joint name="hinge"/><geom size=".4 .02 1"/></body><geom name="lintel"',
            "'hinge'",
        ),
    ],
)
def test_the_faults_of_the_page_are_told(
    old: str, new: str, told: str | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_example_house(tmp_path)
    house = tmp_path / "house.xml"
    text = house.read_text(encoding="utf-8")
    assert old in text
    house.write_text(text.replace(old, new), encoding="utf-8")
    assert main(["check", str(tmp_path), "--json"]) == (2 if told else 0)
    assert told is None or told in capsys.readouterr().out
